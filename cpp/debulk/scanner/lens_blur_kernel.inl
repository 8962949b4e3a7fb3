// The loop of lens_blur.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// What a row's modulation were at the first exposure.
void light_of_row(const FringeLight& light, int row, std::vector<float>& out) {
  const std::size_t first = start_of(light, row);
  out.resize(static_cast<std::size_t>(light.width));
  for (int i = 0, last = light.width - lanes;; i = std::min(i + lanes, last)) {  // the last group overlaps the one before
    const std::size_t at = first + static_cast<std::size_t>(i);
    const Ints exposure = load_ints(light.exposure + at);
    const int one = exposure[0];
    const Floats gain = every(exposure == one) ? all(light.gain[static_cast<std::size_t>(one)]) : gather(light.gain.data(), exposure);
    store(out.data() + i, load(light.modulation + at) * gain);
    if (i == last) break;
  }
}

// grad(phase) . grad(ln(modulation)) along one direction, by central differences. ln(a / b) = 2 atanh((a - b) / (a + b)).
DEBULK_INLINE Floats along(const float* phase, const float* next_phase, const float* light, const float* next_light, Floats most_step) {
  const Floats step = load(next_phase) - load(phase), a = load(next_light), b = load(light), ratio = (a - b) / (a + b);
  const Ints fine = (absolute(step) <= most_step) & (absolute(ratio) <= most_ratio);
  return choose(fine, 0.5f * step * ratio * (1.0f + 0.33333333f * ratio * ratio), all(0.0f));
}

// Writes the row, except its first and last pixel, with the blur removed. `out` must not be one of the three rows.
void run(const Row& above, const Row& here, const Row& below, int width, float variance, float edge, float* out) {
  const Floats most_step = all(2.0f * edge);
  for (int i = 1, last = width - 1 - lanes;; i = i + lanes < last ? i + lanes : last) {
    const Floats across = along(here.phase + i - 1, here.phase + i + 1, here.light + i - 1, here.light + i + 1, most_step);
    const Floats down = along(above.phase + i, below.phase + i, above.light + i, below.light + i, most_step);
    const Floats phase = load(here.phase + i) - variance * (across + down);
    store(out + i, choose(phase < 0.0f, all(0.0f), phase));
    if (i == last) break;
  }
}
