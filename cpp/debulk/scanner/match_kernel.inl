// The loops of match.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

DEBULK_INLINE Floats whole_part(Floats a) {
  return converted<Floats>(converted<Ints>(a));
}

// Places of a row that sixteen pixels look at. Where they stand close together, as on a surface, they are picked from
// registers; else they are gathered.
struct Spot {
  int from;
  bool narrow;

  // `before` and `reach`: number of pixels before the first place and behind the last that are looked at, too.
  DEBULK_INLINE Spot(Floats place, Ints which, int before, int reach) {
    // On a surface all places follow the first lane's. Only elsewhere is it worth to wait for the least and the greatest.
    constexpr int scatter = 8;
    const Ints at = converted<Ints>(place);
    from = std::max(0, at[0] - before - scatter), narrow = true;
    if (any(which & ((at < from + (from > 0 ? before : 0)) | (at >= from + row_room - reach))))
      *this = Spot(lowest(choose(which, place, all(1e9f))), highest(choose(which, place, all(0.0f))), before, reach);
  }
  DEBULK_INLINE Spot(float least, float most, int before, int reach)
      : from(std::max(0, static_cast<int>(least) - before)), narrow(static_cast<int>(most) + reach - from < row_room) {}
  // The places of one group in any row whose values lie alike; `beyond`: pixels behind them.
  struct Group {
    Ints at;
    Near<row_room / lanes> near;
    int from;
    bool narrow;
    DEBULK_INLINE Floats operator()(const std::vector<float>& row, int beyond = 0) const {
      const float* values = row.data() + beyond;
      return narrow ? near(values + from) : gather(values, at);
    }
  };
  // `place` is in the spot, or its value is not used.
  DEBULK_INLINE Group operator()(Floats place) const {
    const Ints at = converted<Ints>(place);
    return {at, Near<row_room / lanes>(at - from), from, narrow};
  }
};

// Makes each value the greatest (or, from the end, the least) of itself and all before it. Sixteen become one in four
// passes, each of which reaches twice as far as the one before; behind the row is room.
void greatest_so_far(float* value, int width) {
  const int groups = (width + lanes - 1) / lanes * lanes;
  for (int reach = 1; reach < lanes; reach *= 2)
    for (int i = groups - lanes; i >= 0; i -= lanes) store(value + i, higher(load(value + i), load(value + i - reach)));
  Floats most = load(value - lanes);
  for (int i = 0; i < groups; i += lanes) store(value + i, most = higher(load(value + i), all(most[lanes - 1])));
}
void least_from_here(float* value, int width) {
  const int groups = (width + lanes - 1) / lanes * lanes;
  for (int reach = 1; reach < lanes; reach *= 2)
    for (int i = 0; i < groups; i += lanes) store(value + i, lower(load(value + i), load(value + i + reach)));
  Floats least = load(value + groups);
  for (int i = groups - lanes; i >= 0; i -= lanes) store(value + i, least = lower(load(value + i), all(least[0])));
}

// Takes a row: finds the range and the order of its phases.
void take(PhaseIndex& index) {
  const float* phase = index.row->phase.data();
  const int width = index.width;
  constexpr float far = std::numeric_limits<float>::infinity();
  index.bins = -1;
  int first = 0, last = width - 1;
  while (first < last && !(phase[first] == phase[first])) ++first;
  while (last > first && !(phase[last] == phase[last])) --last;
  index.turn = phase[last] < phase[first] ? -1.0f : 1.0f;
  index.below.resize(static_cast<std::size_t>(width + 2 * row_room)), index.above.resize(static_cast<std::size_t>(width + 2 * row_room));
  float *below = index.below.data() + row_room, *above = index.above.data() + row_room;
  for (int i = -row_room; i < 0; i += lanes) store(below + i, all(-far));
  for (int i = 0; i < width; i += lanes) {
    const Floats here = load(phase + i) * index.turn;
    const Ints known = here == here;
    store(below + i, choose(known, here, all(-far))), store(above + i, choose(known, here, all(far)));
  }
  for (int i = width; i < width + row_room; ++i) above[i] = far;
  greatest_so_far(below, width), least_from_here(above, width);
  index.low = far, index.high = -far;
  if (above[0] <= below[width - 1] && index.step > 0) {
    const float a = above[0] * index.turn, b = below[width - 1] * index.turn;
    index.low = std::min(a, b), index.high = std::max(a, b);
  }
  below[0] = -far, above[width - 1] = far;  // no segment ends at the first pixel, and none begins at the last
}

// Sorts the row's segments into bins, about one per bin. The number of bins is limited, so that a row of stray phases
// does not take all memory.
void build(PhaseIndex& index) {
  const float* phase = index.row->phase.data();
  const float low = index.low, high = index.high;
  index.bins = 0;
  if (!(low < high)) return;
  index.bins = static_cast<int>(std::min<double>(4.0 * index.width, std::ceil((high - low) / index.step))) + 1;
  index.per_rad = static_cast<float>(index.bins - 1) / (high - low);
  const std::size_t room = static_cast<std::size_t>(index.bins + row_room);
  index.first.assign(room, 1e9f), index.last.assign(room, -1.0f);
  float *first = index.first.data(), *last = index.last.data();
  for (int i = 0; i + 1 < index.width; i += lanes) {
    const Floats a = load(phase + i), b = load(phase + i + 1);
    const Ints surface = absolute(b - a) <= index.edge;
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

// The first and the last place at which a phase occurs, while segments are looked at from left to right.
struct Places {
  struct End {
    Floats j = {}, a = {}, b = {};
    DEBULK_INLINE void set(Ints which, Floats new_j, Floats new_a, Floats new_b) {
      j = choose(which, new_j, j), a = choose(which, new_a, a), b = choose(which, new_b, b);
    }
  };
  End from, to;
  Ints there = {};

  // a, b: the phases at the segment's ends less the phase that is looked for; j: the segment's first pixel.
  DEBULK_INLINE void look(Floats a, Floats b, Floats j, float edge, Ints which) {
    const Ints hit = which & (absolute(b - a) <= edge) & ~(a * b > 0.0f) & (a != b);
    from.set(hit & ~there, j, a, b), to.set(hit, j, a, b);
    there = there | hit;
  }
  DEBULK_INLINE Found found() const {
    Found out;
    out.there = there;
    const Floats from_part = from.a / (from.a - from.b), to_part = to.a / (to.a - to.b);
    // Noise makes a phase recur within a few pixels. If the places are further apart, one of them is not on this surface.
    out.apart_too = there & ((to.j - from.j) + (to_part - from_part) > apart);
    const Floats middle = 0.5f * (from.j + to.j), at = whole_part(middle), part = 0.5f * (from_part + to_part) + (middle - at);
    const Floats next = choose(part >= 1.0f, all(1.0f), all(0.0f));
    out.at = at + next, out.part = part - next;
    return out;
  }
};

// Finds phases wherever they occur in the row, by its bins.
DEBULK_INLINE Found search(PhaseIndex& index, Floats phase, Ints which) {
  if (index.bins < 0) build(index);
  const Floats bin = (phase - index.low) * index.per_rad;
  which &= (bin >= 0.0f) & (bin < static_cast<float>(index.bins));
  if (!any(which)) return {};
  const Spot bins(bin, which, 0, 1);
  const Floats here = choose(which, bin, all(static_cast<float>(bins.from)));
  const auto segments_there = bins(here);
  const Floats first = segments_there(index.first), last = segments_there(index.last);
  which &= first <= last;
  if (!any(which)) return {};
  const float least = lowest(choose(which, first, all(1e9f)));
  const Spot segments(least, highest(choose(which, last, all(0.0f))), 0, 2);
  const Floats begin = choose(which, first, all(least)), end = choose(which, last, all(least));
  const int most = static_cast<int>(highest(end - begin));
  Places places;
  for (int step = 0; step <= most; ++step) {
    const Floats j = lower(begin + static_cast<float>(step), end);  // the last one again does no harm
    const auto ends = segments(j);
    places.look(ends(index.row->phase) - phase, ends(index.row->phase, 1) - phase, j, index.edge, which);
  }
  return places.found();
}

// Finds phases that are expected at a place. If the phases of all pixels before the five segments round it are below, and of
// those behind them above, no others need to be looked at.
Found find(PhaseIndex& index, Floats phase, Ints which, Floats place) {
  constexpr int round_it = 5, tries = 16;
  which &= (phase >= index.low) & (phase <= index.high);
  if (!any(which)) return {};
  const Floats turned = phase * index.turn;
  Floats least = all(0.0f), most = all(static_cast<float>(index.width - 1 - round_it));  // of the segments' first pixel
  for (int k = 0; k < tries; ++k) {
    Floats j = whole_part(higher(lower(place - 2.0f, most), least));
    const Spot spot(j, which, 0, round_it + 1);
    j = choose(which, j, all(static_cast<float>(spot.from)));
    const auto here = spot(j);
    const Floats before = here(index.below, row_room), behind = here(index.above, row_room + round_it);
    const Ints below = (before < turned), above = (behind > turned);
    if (!any(which & ~(below & above))) {
      Places places;
      Floats a = here(index.row->phase) - phase;
      for (int s = 0; s < round_it; ++s) {
        const Floats b = here(index.row->phase, s + 1) - phase;
        places.look(a, b, j + static_cast<float>(s), index.edge, which);
        a = b;
      }
      return places.found();
    }
    if (any(which & ~(below | above))) break;  // the row goes up and down here
    least = choose(above, least, j + 1.0f), most = choose(below, most, j - 1.0f);
    place = j + 2.0f + (turned - here(index.row->phase, 2) * index.turn) * index.per_step;
    place = choose((place - 2.0f >= least) & (place - 2.0f <= most), place, 0.5f * (least + most) + 2.0f);
  }
  return search(index, phase, which);
}

// The usual case: the row goes through each phase once, in one of so many segments from the pixel j on, and all pixels before
// and behind these are on its two sides. Returns the segments' first pixels, and whether it is so.
template <int segments, class Group>
DEBULK_INLINE Floats passage(const PhaseIndex& index, Floats phase, Ints which, Floats j, const Group& here, bool& once) {
  const Floats turned = phase * index.turn;
  Ints sure = (here(index.below, row_room) < turned) & (here(index.above, row_room + segments) > turned), before = ~Ints{};
  Floats at = j;
  for (int s = 1; s < segments; ++s) {
    const Floats value = here(index.row->phase, s) * index.turn;
    const Ints below = value < turned;
    sure &= (below & before) | (value > turned);
    at = choose(below, j + static_cast<float>(s), at), before = below;
  }
  once = !any(which & ~sure);
  return at;
}

// The place in the segment that begins at a pixel. a, b: the phases at its ends less the one that is looked for.
DEBULK_INLINE Found between(Floats a, Floats b, Floats at, Ints which, float edge) {
  Found out;
  out.there = which & (absolute(b - a) <= edge);
  const Floats part = a / (a - b), next = choose(part >= 1.0f, all(1.0f), all(0.0f));
  out.at = at + next, out.part = part - next;
  return out;
}

// Finds phases that are expected at the sixteen pixels from `first` on.
DEBULK_INLINE Found find_back(PhaseIndex& index, Floats phase, Ints which, int first) {
  const Floats column = converted<Floats>(counting() + first);
  if (first > 0) {
    const auto row = [&](const std::vector<float>& values, int beyond = 0)
                         DEBULK_LAMBDA { return load(values.data() + first - 1 + beyond); };
    bool once;
    const Floats at = passage<2>(index, phase, which, column - 1.0f, row, once);
    const Ints second = at == column;
    const Floats here = row(index.row->phase, 1), a = choose(second, here, row(index.row->phase));
    if (once) return between(a - phase, choose(second, row(index.row->phase, 2), here) - phase, at, which, index.edge);
  }
  return find(index, phase, which, column);
}

MatchCounts match(PhaseIndex& left, PhaseIndex& right, float* disparity, float* sigma) {
  MatchCounts counts;
  auto bridged = left.row->bridged.begin();
  const RectifiedRow &own_row = *left.row, &row = *right.row;
  const float last = static_cast<float>(right.width - 1);
  Floats expected = converted<Floats>(counting());  // the columns of the partners, as those before stood to theirs
  for (int i = 0; i < left.width; i += lanes, expected += all(static_cast<float>(lanes))) {
    const Floats phase = load(own_row.phase.data() + i), column = converted<Floats>(counting() + i);
    Ints seen = (phase == phase) & (counting() + i < Ints{} + left.width);
    for (; bridged != own_row.bridged.end() && *bridged < i + lanes; ++bridged) seen[*bridged - i] = 0;
    store(disparity + i, all(nan)), store(sigma + i, all(nan));
    if (!any(seen)) continue;
    counts.seen += __builtin_popcount(bits(seen));
    constexpr int round_it = 3;
    const Floats first = whole_part(higher(lower(expected - 1.0f, all(last - round_it)), all(0.0f)));
    Spot spot(first, seen, 2, round_it + 3);
    const auto within = [&](Floats j, Ints which)
                            DEBULK_LAMBDA { return choose(which, j, lower(all(static_cast<float>(spot.from + 2)), all(last))); };
    bool once;
    Floats at = within(first, seen);
    at = passage<round_it>(right, phase, seen, at, spot(at), once);
    auto place = spot(at);
    Floats here = place(row.phase), next = place(row.phase, 1);
    Found x = between(here - phase, next - phase, at, seen, right.edge);
    once = once && !any(seen & (x.at != at));
    if (!once) x = find(right, phase, seen, expected);
    Ints fine = x.there & ~x.apart_too;
    if (!any(fine)) {
      counts.unmatched += __builtin_popcount(bits(seen & ~x.there)), counts.ambiguous += __builtin_popcount(bits(x.apart_too));
      continue;
    }
    expected = choose(fine, x.at + x.part, expected);
    if (!once) {
      spot = Spot(x.at, fine, 2, 3);
      at = within(x.at, fine), place = spot(at), here = place(row.phase), next = place(row.phase, 1);
    }
    const Floats nearest = choose(x.part >= 0.5f, at + 1.0f, at);
    // The left row, searched for the phase of the partner, must give this pixel again.
    const Found back = find_back(left, choose(x.part >= 0.5f, next, here), fine, i);
    const Ints unmatched = seen & ~(x.apart_too | back.there);
    fine &= back.there & ~back.apart_too;
    // A place exactly on a pixel belongs to the segment before it if no segment begins there. The mean of two places
    // belongs to no segment if they lie on both sides of a gap.
    Floats j = at, t = x.part;
    Ints surface = (j < last) & (absolute(next - here) <= right.edge);
    const Ints before_it = (t == 0.0f) & (j > 0.0f) & ~surface;
    if (any(before_it)) {
      j = choose(before_it, j - 1.0f, j), t = choose(before_it, all(1.0f), t);
      place = spot(j), here = place(row.phase), next = place(row.phase, 1);
      surface = (j < last) & (absolute(next - here) <= right.edge);
    }
    // Slope of the phase, in rad per pixel, round the segment. To reduce noise it is taken over three segments where they
    // are one surface.
    const Floats before = here - spot(higher(j - 1.0f, all(0.0f)))(row.phase), step = next - here;
    const Floats after = place(row.phase, 2) - next;
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
    const Floats f = place(row.fraction), g = load(own_row.fraction.data() + i);
    const Floats w0 = (1.0f - t) * (1.0f - f), w2 = t * f, w1 = 1.0f - w0 - w2;
    const Floats l = load(own_row.noise.data() + i), r = place(row.noise);
    const Floats variance = l * l * ((1.0f - g) * (1.0f - g) + g * g) + r * r * (w0 * w0 + w1 * w1 + w2 * w2);
    store(sigma + i, choose(fine, root(variance) / slope, all(nan)));
  }
  return counts;
}
