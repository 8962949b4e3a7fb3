// The loop of neighbours.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// Checks the pixels of a row, except its first and last, that has a row above and a row below it.
void run(const float* phase, int width, long row, float order_step, std::vector<Change>& found) {
  const Floats half = all(0.5f * order_step);
  const long last = width - 1 - lanes;  // the last group overlaps the one before
  for (long column = 1, taken = 1; taken < width - 1; column += lanes) {
    const long at = row * width + std::min(column, last);
    const Floats here = load(phase + at);
    Ints support = {};
    for (long above = -width; above <= width; above += width)
      for (long beside = -1; beside <= 1; ++beside) {
        const Floats other = load(phase + at + above + beside);
        support -= (absolute(other - here) < half) & (other >= 0.0f);
      }
    support -= 1;  // the pixel itself does not count
    const Ints weak = (here < 0.0f) | ((support < least_support) & (here >= 0.0f));
    for (unsigned which = bits(weak); which != 0; which &= which - 1) {
      const long one = at + __builtin_ctz(which);
      if (one < row * width + taken) continue;
      found.push_back({one, phase[one] < 0 ? repaired(phase, width, one, order_step) : nan});
    }
    taken = std::min(column, last) + lanes;
  }
}
