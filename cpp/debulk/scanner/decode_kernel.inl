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
template <class Pattern>
DEBULK_INLINE Floats wrapped_phase(const Floats* v, const Pattern& t, Floats& offset, Floats& modulation) {
  Floats sum = v[0], c = v[0], s = all(0.0f);
  for (int k = 1; k < t.steps; ++k) sum += v[k], c += v[k] * t.cosine[k], s += v[k] * t.sine[k];
  offset += sum;
  modulation += root(c * c + s * s);
  return angle(-s, c);
}

// What is known of sixteen pixels: of the numbers of periods up to one, or of the best exposure so far.
struct Known {
  Floats wrapped[most_periods], offset, modulation;
  Ints exposure;
};

// Adds the steps of a number of periods, `from` at `at`, to what is kept of the pixels `to`.
template <class T, class Pattern>
DEBULK_INLINE Known add_steps(const T* const* from, long at, const Pattern& t, const Place& place, const Arrived& kept, long to) {
  const auto p = static_cast<std::size_t>(place.period), last = static_cast<std::size_t>(t.periods - 1);
  const Planes& before = place.exposure == 0 ? kept.best : kept.coming;
  Floats value[most_images];
  value[0] = grey(from[0] + at);  // apart, for the compiler cannot know that there is a step
  Floats top = higher(value[0], all(0.0f));
  for (int k = 1; k < t.steps; ++k) value[k] = grey(from[k] + at), top = higher(value[k], top);
  Known out;
  out.offset = p == 0 ? all(0.0f) : load(before.offset + to), out.modulation = p == 0 ? all(0.0f) : load(before.modulation + to);
  out.wrapped[p] = wrapped_phase(value, t, out.offset, out.modulation);
  out.offset = choose(top < t.saturated, out.offset, all(nan));
  if (p < last) return out;
  // The exposure is complete: it takes the place of a shorter one where it can.
  const Ints fine = out.offset == out.offset;
  const bool shorter = place.exposure > 0 && !every(fine);
  for (std::size_t q = 0; q < last; ++q) out.wrapped[q] = load(before.wrapped[q] + to);
  if (shorter) {
    for (std::size_t q = 0; q <= last; ++q) out.wrapped[q] = choose(fine, out.wrapped[q], load(kept.best.wrapped[q] + to));
    out.offset = choose(fine, out.offset, load(kept.best.offset + to));
    out.modulation = choose(fine, out.modulation, load(kept.best.modulation + to));
  }
  out.exposure = choose(fine, Ints{} + place.exposure, shorter ? load_ints(kept.exposure + to) : Ints{} + no_exposure);
  return out;
}

// Takes in sixteen pixels, `to`, of the steps of one number of periods.
template <class T, class Pattern>
DEBULK_INLINE void take(const T* const* from, long at, const Pattern& t, const Place& place, const Arrived& kept, long to) {
  const auto p = static_cast<std::size_t>(place.period);
  const Known now = add_steps(from, at, t, place, kept, to);
  const bool complete = place.period == t.periods - 1;
  const Planes& out = complete || place.exposure == 0 ? kept.best : kept.coming;
  if (complete && place.exposure > 0)
    for (std::size_t q = 0; q < p; ++q) store(out.wrapped[q] + to, now.wrapped[q]);
  store(out.wrapped[p] + to, now.wrapped[p]), store(out.offset + to, now.offset), store(out.modulation + to, now.modulation);
  if (complete) store_bytes(kept.exposure + to, now.exposure);
}

// Takes in groups of sixteen pixels. The call that does the last whole group also does the remaining pixels.
template <class T, class Pattern>
void take_groups(const T* const* from, long pixels, const Pattern& t, const Place& place, const Arrived& kept, long begin, long end) {
  for (long g = begin; g < end; ++g) take(from, g * lanes, t, place, kept, g * lanes);
  const long left = pixels - end * lanes;
  if (left <= 0 || left >= lanes) return;
  T rest[most_images][lanes] = {};
  const T* padded[most_images];
  for (int k = 0; k < t.steps; ++k)
    padded[k] = rest[k], std::memcpy(rest[k], from[k] + end * lanes, static_cast<std::size_t>(left) * sizeof(T));
  take(padded, 0, t, place, kept, end * lanes);
}

// Decodes the sixteen pixels from `at` on, from what has arrived and the last images or, without that, from all images. Only pixels whose
// bit is set in the mask `counted` enter the counts.
template <class T, class Pattern>
DEBULK_INLINE void group(const ImageStack<T>& stack, const Pattern& t, const PhaseMaps& maps, const Arrived* arrived, long at,
                         unsigned counted, DecodeCounts& counts) {
  const int images = t.steps * t.periods;
  Floats wrapped[most_periods], offset = all(0.0f), modulation = all(0.0f);
  Ints open = {}, exposure = {};
  if (arrived) {
    const Place last{stack.exposures - 1, t.periods - 1};
    const Known all_of = add_steps(stack.exposure(last.exposure) + last.period * t.steps, at, t, last, *arrived, at);
    for (int p = 0; p < t.periods; ++p) wrapped[p] = all_of.wrapped[p];
    offset = all_of.offset, modulation = all_of.modulation, exposure = all_of.exposure, open = offset != offset;
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
template <class T, class Pattern>
void run(const ImageStack<T>& stack, const Pattern& t, const PhaseMaps& maps, const Arrived* arrived, long begin, long end,
         DecodeCounts& counts) {
  for (long g = begin; g < end; ++g) group(stack, t, maps, arrived, g * lanes, 0xffff, counts);
  const long left = stack.pixels - end * lanes;
  if (left > 0 && left < lanes) group(stack, t, maps, arrived, stack.pixels - lanes, 0xffff << (lanes - left) & 0xffff, counts);
}
