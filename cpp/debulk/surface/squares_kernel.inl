// Draws squares of four neighbouring pixels, sixteen at once; gridding.cpp includes this file once per Isa (see
// core/simd_dispatch.inl).

// The whole numbers at or above, and at or below.
DEBULK_INLINE Floats up(Floats a) {
  const Floats whole = converted<Floats>(converted<Ints>(a));
  return choose(a > whole, whole + 1.0F, whole);
}
DEBULK_INLINE Floats down(Floats a) {
  return -up(-a);
}

struct Corner {
  Floats u, v, z;
};
DEBULK_INLINE Corner corner(const SquareRow& row, std::size_t at) {
  return {load(row.u + at), load(row.v + at), load(row.z + at)};
}
DEBULK_INLINE Corner choose(Ints mask, const Corner& a, const Corner& b) {
  return {choose(mask, a.u, b.u), choose(mask, a.v, b.v), choose(mask, a.z, b.z)};
}

// The straight line from one corner to another: on which side of it a point lies, and how far away, times its length.
// Squares that share it compute it from the same end, so that no point lies outside both.
struct Side {
  Floats u, v, along_u, along_v, across;
  DEBULK_INLINE Side(const Corner& from, const Corner& to) : u(from.u), v(from.v), along_u(to.u - from.u), along_v(to.v - from.v) {}
  DEBULK_INLINE void turn(Floats sign) { along_u = along_u * sign, along_v = along_v * sign; }
  DEBULK_INLINE void on_line(Floats line) { across = along_u * (line - v); }
  DEBULK_INLINE Floats at(Floats column) const { return across - along_v * (column - u); }
};

// A triangle: a side that it shares with the next square, with the corners at its ends and the one opposite to it; a second
// such side, and the diagonal, which is opposite to `far`.
struct Triangle {
  Ints drawn;
  Floats z, by_side, by_diagonal, lowest, highest, turn;

  // doubled: its area, twice, positive if it lies on the positive side of its shared side. `z`: of the corner where the
  // weights of both others are 0, `opposite` and `far` those of the corners whose weights the sides give.
  DEBULK_INLINE Triangle(Ints near, Floats doubled, Floats at, Floats opposite, Floats far) : drawn(near & (doubled != 0.0F)), z(at) {
    const Floats area = absolute(doubled);
    by_side = (opposite - at) / area, by_diagonal = (far - at) / area;
    lowest = lower(lower(at, opposite), far), highest = higher(higher(at, opposite), far);
    turn = choose(doubled < 0.0F, all(-1.0F), all(1.0F));
  }
  DEBULK_INLINE Floats height(Floats side, Floats diagonal) const {
    return lower(higher(z + (side * by_side + diagonal * by_diagonal), lowest), highest);
  }
};

DEBULK_INLINE void draw_sixteen(const SquareRow& row, std::size_t at) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  // The corners are a, b beside a, c below a and d below b. The diagonal is the one with the smaller step in height or, if
  // a corner is missing, the one through corners that were seen: the triangles are a, b, d and a, d, c, or a, b, c and
  // b, d, c.
  const Corner a = corner(row, at), b = corner(row, at + 1), c = corner(row, at + row.pitch), d = corner(row, at + row.pitch + 1);
  const Ints ad = ~((b.z == b.z) & (c.z == c.z)) | (absolute(a.z - d.z) <= absolute(b.z - c.z));
  const auto near = [&](const Corner& p, const Corner& q) DEBULK_LAMBDA {
    const Floats du = p.u - q.u, dv = p.v - q.v, dz = (p.z - q.z) * row.cells_per_mm;
    return du * du + (dv * dv + dz * dz) <= row.longest_squared;
  };
  const Corner from = choose(ad, a, b), to = choose(ad, d, c), above = choose(ad, b, a), below = choose(ad, c, d);
  const Ints near_diagonal = near(from, to), near_ac = near(a, c), near_bd = near(b, d);
  const Ints upper_near = near_diagonal & near(a, b) & choose(ad, near_bd, near_ac);
  const Ints lower_near = near_diagonal & near(c, d) & choose(ad, near_ac, near_bd);
  if (!any(upper_near | lower_near)) return;

  Side ab(a, b), cd(c, d), ac(a, c), bd(b, d), diagonal(from, to);
  const Floats one = all(1.0F), sign = choose(ad, one, -one);
  // Twice the areas, positive if the corners a, b and c turn as u and v do.
  const auto turned = [](const Corner& p, const Corner& q, const Corner& r)
                          DEBULK_LAMBDA { return (q.u - p.u) * (r.v - p.v) - (q.v - p.v) * (r.u - p.u); };
  const Triangle upper(upper_near, turned(a, b, choose(ad, d, c)), choose(ad, a, b).z, choose(ad, d, c).z, above.z);
  const Triangle beneath(lower_near, turned(choose(ad, a, b), d, c), choose(ad, d, c).z, choose(ad, a, b).z, below.z);
  Side upper_side = ac, lower_side = bd;
  upper_side.u = choose(ad, bd.u, ac.u), upper_side.v = choose(ad, bd.v, ac.v);
  upper_side.along_u = choose(ad, bd.along_u, ac.along_u), upper_side.along_v = choose(ad, bd.along_v, ac.along_v);
  lower_side.u = choose(ad, ac.u, bd.u), lower_side.v = choose(ad, ac.v, bd.v);
  lower_side.along_u = choose(ad, ac.along_u, bd.along_u), lower_side.along_v = choose(ad, ac.along_v, bd.along_v);
  ab.turn(upper.turn), upper_side.turn(upper.turn * sign);
  cd.turn(-beneath.turn), lower_side.turn(-(beneath.turn * sign));
  const Floats upper_turn = -(upper.turn * sign), lower_turn = beneath.turn * sign;

  const Ints drawn = upper.drawn | beneath.drawn;
  const auto least = [&](Floats p, Floats q, Floats of_above, Floats of_below) DEBULK_LAMBDA {
    return lower(lower(p, q), lower(choose(upper.drawn, of_above, p), choose(beneath.drawn, of_below, p)));
  };
  const auto most = [&](Floats p, Floats q, Floats of_above, Floats of_below) DEBULK_LAMBDA {
    return higher(higher(p, q), higher(choose(upper.drawn, of_above, p), choose(beneath.drawn, of_below, p)));
  };
  const Floats none = all(0.0F);
  const auto box = [&](Floats low, Floats high, float first, float last, Floats& begin, Floats& end) DEBULK_LAMBDA {
    begin = up(choose(drawn, higher(low, all(first)), none)), end = down(choose(drawn, lower(high, all(last)), none - 1.0F));
    return static_cast<int>(highest(end - begin)) + 1;
  };
  Floats line, last_line, first_column, last_column;
  const int lines =
      box(least(from.v, to.v, above.v, below.v), most(from.v, to.v, above.v, below.v), row.first_line, row.last_line, line, last_line);
  const int columns = box(least(from.u, to.u, above.u, below.u), most(from.u, to.u, above.u, below.u), row.first_column, row.last_column,
                          first_column, last_column);
  if (lines <= 0 || columns <= 0) return;
  for (int n = 0; n < lines; ++n, line = line + 1.0F) {
    ab.on_line(line), cd.on_line(line), upper_side.on_line(line), lower_side.on_line(line), diagonal.on_line(line);
    const Ints on = line <= last_line;
    Floats column = first_column;
    for (int m = 0; m < columns; ++m, column = column + 1.0F) {
      const Floats across = diagonal.at(column);
      const Floats above_side = ab.at(column), above_diagonal = across * upper_turn;
      const Floats below_side = cd.at(column), below_diagonal = across * lower_turn;
      const Ints here = on & (column <= last_column);
      const Ints in_upper = here & upper.drawn & (above_side >= 0.0F) & (above_diagonal >= 0.0F) & (upper_side.at(column) >= 0.0F);
      const Ints in_lower = here & beneath.drawn & (below_side >= 0.0F) & (below_diagonal >= 0.0F) & (lower_side.at(column) >= 0.0F);
      unsigned seen = bits(in_upper | in_lower);
      if (seen == 0) continue;
      alignas(64) float z[lanes];
      alignas(64) int j[lanes], i[lanes];
      write(z, higher(choose(in_upper, upper.height(above_side, above_diagonal), all(-infinity)),
                      choose(in_lower, beneath.height(below_side, below_diagonal), all(-infinity))));
      write(j, converted<Ints>(line - row.first_line)), write(i, converted<Ints>(column - row.first_column));
      for (; seen != 0; seen &= seen - 1) {
        const int k = __builtin_ctz(seen);
        float& highest_yet = row.out[static_cast<std::size_t>(j[k]) * row.wide + static_cast<std::size_t>(i[k])];
        if (z[k] > highest_yet) highest_yet = z[k];
      }
    }
  }
}

inline void draw(const SquareRow& row) {
  for (std::size_t k = 0; k < row.count; k += lanes) draw_sixteen(row, k);
}
