// The loop of isolated.cpp: included there once for each Isa (see core/each_isa.inl).

// A row that has one above and one below it; its first and last pixel are let be.
void run(const float* phase, int width, long row, int least, std::vector<long>& found) {
  constexpr float half_period = 3.14159265f;
  const long last = width - 1 - lanes;  // the last group overlaps the one before
  for (long column = 1, taken = 1; taken < width - 1; column += lanes) {
    const long at = row * width + std::min(column, last);
    const Floats here = load(phase + at);
    Ints support = {};
    for (long above = -width; above <= width; above += width)
      for (long beside = -1; beside <= 1; ++beside)
        if (above != 0 || beside != 0) support -= absolute(load(phase + at + above + beside) - here) < half_period;
    const Ints alone = (support < least) & (here == here);
    for (unsigned which = bits(alone); which != 0; which &= which - 1) {
      const long one = at + __builtin_ctz(which);
      if (one >= row * width + taken) found.push_back(one);
    }
    taken = std::min(column, last) + lanes;
  }
}
