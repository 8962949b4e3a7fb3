// The loops of match.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

DEBULK_INLINE Floats whole_part(Floats a) {
  return converted<Floats>(converted<Ints>(a));
}

// Places of a row that sixteen pixels look at. Where they stand close together, as on a surface, they are picked from
// registers; else they are gathered.
struct Spot {
  int from;
  bool narrow;

  // `reach`: number of pixels behind the last place that are looked at, too.
  DEBULK_INLINE Spot(Floats place, Ints which, int before, int reach)
      : Spot(lowest(choose(which, place, all(1e9f))), highest(choose(which, place, all(0.0f))), before, reach) {}
  DEBULK_INLINE Spot(float least, float most, int before, int reach)
      : from(std::max(0, static_cast<int>(least) - before)), narrow(static_cast<int>(most) + reach - from < row_room) {}
  // `place` is in the spot, or its value is not used.
  DEBULK_INLINE Floats operator()(const std::vector<float>& row, Floats place) const {
    const Ints at = converted<Ints>(place);
    return narrow ? pick<row_room / lanes>(row.data() + from, at - from) : gather(row.data(), at);
  }
};

// Sorts the row's segments into bins, about one per bin. The number of bins is limited, so that a row of stray phases
// does not take all memory.
void build(PhaseIndex& index, float step) {
  const float* phase = index.row->phase.data();
  const Ints ends = Ints{} + index.width;
  Floats least = all(std::numeric_limits<float>::infinity()), most = -least;
  for (int i = 0; i < index.width; i += lanes) {
    const Floats here = choose(counting() + i < ends, load(phase + i), all(nan));
    least = lower(here, least), most = higher(here, most);
  }
  const float low = lowest(least), high = highest(most);
  index.bins = 0;
  if (!(low < high) || !(step > 0)) return;
  index.bins = static_cast<int>(std::min<double>(4.0 * index.width, std::ceil((high - low) / step))) + 1;
  index.low = low, index.per_rad = static_cast<float>(index.bins - 1) / (high - low);
  const std::size_t room = static_cast<std::size_t>(index.bins + row_room);
  index.first.assign(room, 1e9f), index.last.assign(room, -1.0f);
  float *first = index.first.data(), *last = index.last.data();
  for (int i = 0; i + 1 < index.width; i += lanes) {
    const Floats a = load(phase + i), b = load(phase + i + 1);
    const Ints surface = (absolute(b - a) <= index.edge) & (counting() + (i + 1) < ends);
    int from[lanes], to[lanes];
    write(from, converted<Ints>(choose(surface, (lower(a, b) - low) * index.per_rad, all(0.0f))));
    write(to, converted<Ints>(choose(surface, (higher(a, b) - low) * index.per_rad, all(0.0f))));
    for (unsigned which = bits(surface); which != 0; which &= which - 1) {
      const int lane = __builtin_ctz(which), begin = from[lane], end = to[lane];
      const float j = static_cast<float>(i + lane);
      const auto reach = [&](int k) DEBULK_LAMBDA { first[k] = std::min(first[k], j), last[k] = j; };
      // Most segments reach into one to three bins; which of these, no processor foresees.
      reach(begin), reach(std::min(begin + 1, end)), reach(std::min(begin + 2, end));
      for (int k = begin + 3; k <= end; ++k) reach(k);
    }
  }
}

// Where phases occur in a row: the part of the way from the pixel `at` to the next.
struct Found {
  Floats at = {}, part = {};
  Ints there = {}, apart_too = {};  // masks: whether there is such a place; whether there are two far apart
};

DEBULK_INLINE Found find(const PhaseIndex& index, Floats phase, Ints which) {
  Found out;
  const Floats bin = (phase - index.low) * index.per_rad;
  which &= (bin >= 0.0f) & (bin < static_cast<float>(index.bins));
  if (!any(which)) return out;
  const Spot bins(bin, which, 0, 1);
  const Floats here = choose(which, bin, all(static_cast<float>(bins.from)));
  const Floats first = bins(index.first, here), last = bins(index.last, here);
  which &= first <= last;
  if (!any(which)) return out;
  const float least = lowest(choose(which, first, all(1e9f)));
  const Spot segments(least, highest(choose(which, last, all(0.0f))), 0, 2);
  const Floats begin = choose(which, first, all(least)), end = choose(which, last, all(least));
  const int most = static_cast<int>(highest(end - begin));
  Floats from = all(0.0f), from_part = all(0.0f), to = all(0.0f), to_part = all(0.0f);
  for (int step = 0; step <= most; ++step) {
    const Floats j = lower(begin + static_cast<float>(step), end);  // the last one again does no harm
    const Floats a = segments(index.row->phase, j) - phase, b = segments(index.row->phase, j + 1.0f) - phase;
    const Ints hit = which & (absolute(b - a) <= index.edge) & ~(a * b > 0.0f) & (a != b), new_one = hit & ~out.there;
    const Floats part = a / (a - b);
    from = choose(new_one, j, from), from_part = choose(new_one, part, from_part);
    to = choose(hit, j, to), to_part = choose(hit, part, to_part);
    out.there = out.there | hit;
  }
  // Noise makes a phase recur within a few pixels. If the places are further apart, one of them is not on this surface.
  out.apart_too = out.there & ((to - from) + (to_part - from_part) > apart);
  const Floats middle = 0.5f * (from + to), at = whole_part(middle), part = 0.5f * (from_part + to_part) + (middle - at);
  const Floats next = choose(part >= 1.0f, all(1.0f), all(0.0f));
  out.at = at + next, out.part = part - next;
  return out;
}

MatchCounts match(const PhaseIndex& left, const PhaseIndex& right, float* disparity, float* sigma) {
  MatchCounts counts;
  auto bridged = left.row->bridged.begin();
  const RectifiedRow &own_row = *left.row, &row = *right.row;
  const float last = static_cast<float>(right.width - 1);
  for (int i = 0; i < left.width; i += lanes) {
    const Floats phase = load(own_row.phase.data() + i), column = converted<Floats>(counting() + i);
    Ints seen = (phase == phase) & (counting() + i < Ints{} + left.width);
    for (; bridged != own_row.bridged.end() && *bridged < i + lanes; ++bridged) seen[*bridged - i] = 0;
    store(disparity + i, all(nan)), store(sigma + i, all(nan));
    if (!any(seen)) continue;
    counts.seen += __builtin_popcount(bits(seen));
    const Found x = find(right, phase, seen);
    Ints fine = x.there & ~x.apart_too;
    if (!any(fine)) {
      counts.unmatched += __builtin_popcount(bits(seen & ~x.there)), counts.ambiguous += __builtin_popcount(bits(x.apart_too));
      continue;
    }
    // The left row, searched for the phase of the partner, must give this pixel again.
    const Spot spot(x.at, fine, 2, 3);
    const Floats beyond = all(static_cast<float>(spot.from + 2));
    const Floats at = choose(fine, x.at, lower(beyond, all(last))), nearest = choose(x.part >= 0.5f, at + 1.0f, at);
    const Found back = find(left, spot(row.phase, nearest), fine);
    const Ints unmatched = seen & ~(x.apart_too | back.there);
    fine &= back.there & ~back.apart_too;
    // A place exactly on a pixel belongs to the segment before it if no segment begins there. The mean of two places
    // belongs to no segment if they lie on both sides of a gap.
    Floats j = at, t = x.part, here = spot(row.phase, j), next = spot(row.phase, lower(j + 1.0f, all(last)));
    Ints surface = (j < last) & (absolute(next - here) <= right.edge);
    const Ints before_it = (t == 0.0f) & (j > 0.0f) & ~surface;
    if (any(before_it)) {
      j = choose(before_it, j - 1.0f, j), t = choose(before_it, all(1.0f), t);
      here = spot(row.phase, j), next = spot(row.phase, lower(j + 1.0f, all(last)));
      surface = (j < last) & (absolute(next - here) <= right.edge);
    }
    // Slope of the phase, in rad per pixel, round the segment. To reduce noise it is taken over three segments where they
    // are one surface.
    const Floats before = here - spot(row.phase, higher(j - 1.0f, all(0.0f))), step = next - here;
    const Floats after = spot(row.phase, lower(j + 2.0f, all(last))) - next;
    const Ints three = (j >= 1.0f) & (j + 2.0f <= last) & (absolute(before) <= right.edge) & (absolute(after) <= right.edge);
    const Floats slope = absolute(choose(three, (before + step + after) / 3.0f, step));
    fine &= surface & (slope > 0.0f);
    const Floats own = choose(column < static_cast<float>(left.width - 1), absolute(load(own_row.phase.data() + i + 1) - phase), all(nan));
    const Floats stretch = choose((own > 0.25f * slope) & (own < 4.0f * slope), slope / own, all(1.0f));
    fine &= absolute((back.at - column) + back.part - ((nearest - at) - x.part) * stretch) <= most_shift;
    counts.unmatched += __builtin_popcount(bits(unmatched)), counts.ambiguous += __builtin_popcount(bits(seen & ~unmatched & ~fine));
    counts.matched += __builtin_popcount(bits(fine));
    store(disparity + i, choose(fine, (column - at) - x.part, all(nan)));
    // The phase was interpolated twice along the row, by the rectification and here, which gives the weights of three
    // pixels.
    const Floats f = spot(row.fraction, j), g = load(own_row.fraction.data() + i);
    const Floats w0 = (1.0f - t) * (1.0f - f), w2 = t * f, w1 = 1.0f - w0 - w2;
    const Floats l = load(own_row.noise.data() + i), r = spot(row.noise, j);
    const Floats variance = l * l * ((1.0f - g) * (1.0f - g) + g * g) + r * r * (w0 * w0 + w1 * w1 + w2 * w2);
    store(sigma + i, choose(fine, root(variance) / slope, all(nan)));
  }
  return counts;
}
