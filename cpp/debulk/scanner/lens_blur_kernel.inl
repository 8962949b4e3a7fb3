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

// grad(phase) . grad(ln(modulation)) along one direction, by central differences; `unknown` where phase or light has an edge.
// ln(a / b) = 2 atanh((a - b) / (a + b)), of which the estimate divides by three, and the correction, of every pixel, multiplies.
template <bool estimate = false>
DEBULK_INLINE Floats along(const float* phase, const float* next_phase, const float* light, const float* next_light, float edge,
                           float unknown = 0) {
  const Floats step = load(next_phase) - load(phase), a = load(next_light), b = load(light), ratio = (a - b) / (a + b);
  const Ints fine = (absolute(step) <= 2.0f * edge) & (absolute(ratio) <= most_ratio);
  const Floats third = estimate ? ratio * ratio / 3.0f : 0.33333333f * ratio * ratio;
  return choose(fine, 0.5f * step * ratio * (1.0f + third), all(unknown));
}

// The same along a row, NaN where it is not known; not of its first and last pixel.
DEBULK_INLINE void along_row(const float* phase, const std::vector<float>& light, float edge, std::vector<float>& out) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const int width = static_cast<int>(light.size());
  out.assign(light.size() + 2 * lanes, nan);
  for (int i = 1, last = width - 1 - lanes;; i = std::min(i + lanes, last)) {
    store(out.data() + i, along<true>(phase + i - 1, phase + i + 1, light.data() + i - 1, light.data() + i + 1, edge, nan));
    if (i == last) break;
  }
}

// How the value of each pixel differs from those at its sides.
DEBULK_INLINE Floats bend(const float* a) {
  return load(a) - 0.5f * (load(a - reach) + load(a + reach));
}

// Takes the pixels of a row, except those near its ends. Two rows above and two below it are read.
void sample_row(const float* phase, const FringeLight& light, int row, float edge, Round& rows, Samples& out) {
  for (int k = 0; k <= 2 * reach; ++k) light_of_row(light, row + k - reach, rows.light[k]);
  const auto phases = [&](int beside) { return phase + start_of(light, row + beside); };
  along_row(phases(-reach), rows.light[0], edge, rows.above), along_row(phases(reach), rows.light[2 * reach], edge, rows.below);
  along_row(phases(0), rows.light[reach], edge, rows.here);
  const int end = light.width - reach;
  for (int i = 1, last = light.width - 1 - lanes, taken = 1; taken < light.width - 1; i = std::min(i + lanes, last)) {
    const Floats down =
        along<true>(phases(-1) + i, phases(1) + i, rows.light[reach - 1].data() + i, rows.light[reach + 1].data() + i, edge);
    const Floats here = load(rows.here.data() + i);
    store(rows.here.data() + i, choose(counting() + i >= taken, here + down, here));  // the last group overlaps the one before
    taken = i + lanes;
  }
  std::size_t count = 0;
  const auto room = static_cast<std::size_t>(light.width + lanes);
  out.bend.resize(room), out.texture.resize(room), out.beside.resize(room);
  for (int i = reach; i < end; i += lanes) {
    const Floats own = bend(phases(0) + i), texture = bend(rows.here.data() + i);
    const Floats beside = bend(rows.above.data() + i) + bend(rows.below.data() + i);
    const auto finite = [](Floats a) DEBULK_LAMBDA { return absolute(a) <= std::numeric_limits<float>::max(); };
    const Ints known = finite(own) & finite(texture) & finite(beside) & (counting() + i < end);
    if (every(known)) {
      store(out.bend.data() + count, own), store(out.texture.data() + count, texture), store(out.beside.data() + count, beside);
      count += lanes;
      continue;
    }
    for (unsigned which = bits(known); which != 0; which &= which - 1, ++count) {
      const int one = __builtin_ctz(which);
      out.bend[count] = own[one], out.texture[count] = texture[one], out.beside[count] = beside[one];
    }
  }
  out.bend.resize(count), out.texture.resize(count), out.beside.resize(count);
}

// Writes the row, except its first and last pixel, with the blur removed. `out` must not be one of the three rows.
void run(const Row& above, const Row& here, const Row& below, int width, float variance, float edge, float* out) {
  for (int i = 1, last = width - 1 - lanes;; i = i + lanes < last ? i + lanes : last) {
    const Floats across = along(here.phase + i - 1, here.phase + i + 1, here.light + i - 1, here.light + i + 1, edge);
    const Floats down = along(above.phase + i, below.phase + i, above.light + i, below.light + i, edge);
    const Floats phase = load(here.phase + i) - variance * (across + down);
    store(out + i, choose(phase < 0.0f, all(0.0f), phase));
    if (i == last) break;
  }
}
