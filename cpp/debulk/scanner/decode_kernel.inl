// The loop of decode.cpp, which includes this file once per Isa (see core/simd_dispatch.inl). Phases are in turns
// here.

template <class T>
DEBULK_INLINE Floats grey(const T* from) {
  return converted<Floats>(load_ints(from));
}

DEBULK_INLINE Floats floor_of(Floats a) {
  const Floats whole = converted<Floats>(converted<Ints>(a));
  return choose(whole > a, whole - 1.0f, whole);
}
DEBULK_INLINE Floats nearest_whole(Floats a) {
  return floor_of(a + 0.5f);
}

// The angle of (x, y) in turns, -0.5 to 0.5, by a polynomial through Chebyshev's points for atan(t) / t over
// 0 <= t² <= 1. Its error is 2e-8 turns at most, rounding included.
DEBULK_INLINE Floats angle(Floats y, Floats x) {
  const Floats ax = absolute(x), ay = absolute(y);
  const Floats most = higher(ax, ay), t = lower(ax, ay) / choose(most > 0.0f, most, all(1.0f)), s = t * t;
  Floats p = 0.0004510553553700447f * s - 0.0025472796987742186f;
  p = p * s + 0.006778028327971697f;
  p = p * s - 0.011929372325539589f;
  p = p * s + 0.01692892052233219f;
  p = p * s - 0.022604092955589294f;
  p = p * s + 0.03181902691721916f;
  p = p * s - 0.05305122211575508f;
  p = p * s + 0.15915493667125702f;
  p = p * t;
  p = choose(ay > ax, 0.25f - p, p);
  p = choose(x < 0.0f, 0.5f - p, p);
  return choose(y < 0.0f, -p, p);
}

// Returns the wrapped phase of the grey values of one number of periods, turns. Adds their sum to the offset, and the
// length of their fringe's sum to the modulation.
DEBULK_INLINE Floats wrapped_phase(const Floats* v, const Tables& t, Floats& offset, Floats& modulation) {
  Floats sum = v[0], c = v[0], s = all(0.0f);
  for (int k = 1; k < t.steps; ++k) sum += v[k], c += v[k] * t.cosine[k], s += v[k] * t.sine[k];
  offset += sum;
  modulation += root(c * c + s * s);
  return angle(-s, c);
}

// Takes in sixteen pixels, `to`, of the steps of one number of periods.
template <class T>
DEBULK_INLINE void take(const T* const* from, long at, const Tables& t, const Place& place, const Arrived& kept, long to) {
  const auto p = static_cast<std::size_t>(place.period), last = static_cast<std::size_t>(t.periods - 1);
  const Planes& into = place.exposure == 0 ? kept.best : kept.coming;
  Floats value[most_images];
  value[0] = grey(from[0] + at);  // apart, for the compiler cannot know that there is a step
  Floats top = higher(value[0], all(0.0f));
  for (int k = 1; k < t.steps; ++k) value[k] = grey(from[k] + at), top = higher(value[k], top);
  Floats offset = p == 0 ? all(0.0f) : load(into.offset + to), modulation = p == 0 ? all(0.0f) : load(into.modulation + to);
  Floats wrapped = wrapped_phase(value, t, offset, modulation);
  offset = choose(top < t.saturated, offset, all(nan));
  const Ints fine = offset == offset;
  if (place.exposure > 0 && p == last) {  // the exposure is complete: it takes the place of a shorter one where it can
    for (std::size_t q = 0; q < last; ++q)
      store(kept.best.wrapped[q] + to, choose(fine, load(into.wrapped[q] + to), load(kept.best.wrapped[q] + to)));
    wrapped = choose(fine, wrapped, load(kept.best.wrapped[p] + to)), offset = choose(fine, offset, load(kept.best.offset + to));
    modulation = choose(fine, modulation, load(kept.best.modulation + to));
  }
  const Planes& out = p == last ? kept.best : into;
  store(out.wrapped[p] + to, wrapped), store(out.offset + to, offset), store(out.modulation + to, modulation);
  if (p == last) {
    const Ints before = place.exposure == 0 ? Ints{} + no_exposure : load_ints(kept.exposure + to);
    store_bytes(kept.exposure + to, choose(fine, Ints{} + place.exposure, before));
  }
}

// Takes in groups of sixteen pixels. The call that does the last whole group also does the remaining pixels.
template <class T>
void take_groups(const T* const* from, long pixels, const Tables& t, const Place& place, const Arrived& kept, long begin, long end) {
  for (long g = begin; g < end; ++g) take(from, g * lanes, t, place, kept, g * lanes);
  const long left = pixels - end * lanes;
  if (left <= 0 || left >= lanes) return;
  T rest[most_images][lanes] = {};
  const T* padded[most_images];
  for (int k = 0; k < t.steps; ++k)
    padded[k] = rest[k], std::memcpy(rest[k], from[k] + end * lanes, static_cast<std::size_t>(left) * sizeof(T));
  take(padded, 0, t, place, kept, end * lanes);
}

// Decodes the sixteen pixels from `at` on, from what has arrived or, without that, from the images. Only pixels whose bit
// is set in the mask `counted` enter the counts.
template <class T>
DEBULK_INLINE void group(const ImageStack<T>& stack, const Tables& t, const PhaseMaps& maps, const Arrived* arrived, long at,
                         unsigned counted, DecodeCounts& counts) {
  const int images = t.steps * t.periods;
  Floats wrapped[most_periods] = {}, offset = all(0.0f), modulation = all(0.0f);
  Ints open = {}, exposure = {};
  if (arrived) {
    for (std::size_t p = 0; p < static_cast<std::size_t>(t.periods); ++p) wrapped[p] = load(arrived->best.wrapped[p] + at);
    offset = load(arrived->best.offset + at), modulation = load(arrived->best.modulation + at);
    exposure = load_ints(arrived->exposure + at), open = offset != offset;
    counts.read += static_cast<long>(lanes) * images * stack.exposures;
  } else {
    Floats value[most_images];
    for (int e = stack.exposures - 1; e >= 0; --e) {
      const T* const* from = stack.exposure(e);
      Floats top = all(0.0f);
      Ints fine;
      if (e == stack.exposures - 1) {
        for (int k = 0; k < images; ++k) value[k] = grey(from[k] + at), top = higher(value[k], top);
        fine = top < t.saturated;
        exposure = choose(fine, Ints{} + e, Ints{} + no_exposure);
        open = ~fine;
      } else {
        Floats here[most_images];
        for (int k = 0; k < images; ++k) here[k] = grey(from[k] + at), top = higher(here[k], top);
        fine = (top < t.saturated) & open;
        for (int k = 0; k < images; ++k) value[k] = choose(fine, here[k], value[k]);
        exposure = choose(fine, Ints{} + e, exposure);
        open &= ~fine;
      }
      counts.read += static_cast<long>(lanes) * images;
      if (!any(open)) break;
    }
    for (int p = 0; p < t.periods; ++p) wrapped[p] = wrapped_phase(value + p * t.steps, t, offset, modulation);
  }
  for (int p = 0; p < t.periods; ++p) wrapped[p] -= t.start;
  offset = offset * (0.5f * t.per_step / static_cast<float>(t.periods));
  modulation = modulation * (t.per_step / static_cast<float>(t.periods));
  const Floats noise = root(t.read + t.gain * offset) / choose(modulation > 0.0f, modulation, all(1e-30f));
  const Ints lit = (noise * t.contrast < 1.0f) & ~open;

  // The fringe order of each stage follows from the stage before. Orders count from the field's edge. Noise may take a
  // phase across that edge, so the phase is wrapped round the field.
  Floats absolute_phase = all(0.0f), residual = all(0.0f);
  for (int s = 0; s < t.stages; ++s) {
    Floats w = all(0.0f);
    for (int p = 0; p < t.periods; ++p) w += t.weight[s][p] * wrapped[p];
    w -= floor_of(w);
    if (s == 0) {
      absolute_phase = w;
      continue;
    }
    const Floats expected = absolute_phase * t.stage_ratio[s] - w, order = nearest_whole(expected);
    residual = higher(residual, absolute(expected - order));
    absolute_phase = w + order;
    absolute_phase -= t.stage_periods[s] * floor_of(absolute_phase * (1.0f / t.stage_periods[s]));
  }
  Floats better = absolute_phase;
  for (int p = 0; p < t.periods; ++p) {
    if (p == t.top) continue;
    const Floats expected = absolute_phase * t.period_count[p] - wrapped[p], off = expected - nearest_whole(expected);
    residual = higher(residual, absolute(off));
    better -= t.share[p] * off;
  }
  const Ints sure = lit & (residual <= t.most_residual) & (noise * (t.turn_noise * t.order_noise) <= t.most_order_noise);

  const Floats none = all(nan);
  const Floats phase = higher(higher(better, all(0.0f)) * t.to_rad + t.back, all(0.0f));
  if (maps.phase) store(maps.phase + at, choose(sure, phase, choose(lit, -1.0f - phase, none)));
  if (maps.noise) store(maps.noise + at, choose(lit, noise * t.phase_noise, none));
  if (maps.modulation) store(maps.modulation + at, choose(open, none, modulation));
  if (maps.offset) store(maps.offset + at, choose(open, none, offset));
  if (maps.residual) store(maps.residual + at, choose(lit, residual, none));
  if (maps.exposure) store_bytes(maps.exposure + at, exposure);
  counts.lit += __builtin_popcount(bits(lit) & counted);
  counts.doubtful += __builtin_popcount(bits(lit & ~sure) & counted);
  counts.saturated += __builtin_popcount(bits(open) & counted);
}

// Decodes groups of sixteen pixels. The call that does the last whole group also decodes the remaining pixels, in a
// group that overlaps the one before.
template <class T>
void run(const ImageStack<T>& stack, const Tables& t, const PhaseMaps& maps, const Arrived* arrived, long begin, long end,
         DecodeCounts& counts) {
  for (long g = begin; g < end; ++g) group(stack, t, maps, arrived, g * lanes, 0xffff, counts);
  const long left = stack.pixels - end * lanes;
  if (left > 0 && left < lanes) group(stack, t, maps, arrived, stack.pixels - lanes, 0xffff << (lanes - left) & 0xffff, counts);
}
