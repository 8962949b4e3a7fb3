#include "debulk/surface/small_holes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace debulk {

const SmallHoles& SmallHoles::table() {
  static const SmallHoles holes;
  return holes;
}

int SmallHoles::number(const Hole& hole) {
  if (hole.count > most) return -1;
  int out = 0;
  for (int k = hole.count - 1; k > 0; --k) {
    const int di = hole.cells[k].i - hole.cells[0].i + wide / 2, dj = hole.cells[k].j - hole.cells[0].j;
    if (di < 0 || di >= wide || dj >= places / wide) return -1;
    out = out * places + dj * wide + di;
  }
  return out;
}

SmallHoles::SmallHoles() {
  constexpr int middle = side / 2;
  const auto touch = [](const Cell& a, const Cell& b) { return std::max(std::abs(a.i - b.i), std::abs(a.j - b.j)) == 1; };
  const auto study = [&](const std::vector<Cell>& cells) {
    Hole hole{cells.data(), static_cast<int>(cells.size()), side, 0, side, 0};
    for (const Cell& c : cells) {
      hole.left = std::min(hole.left, c.i), hole.right = std::max(hole.right, c.i);
      hole.low = std::min(hole.low, c.j), hole.high = std::max(hole.high, c.j);
    }
    Shape& shape = shapes_[static_cast<std::size_t>(number(hole))];
    Grid<float> heights(side, side, {0, 0}, 1.0, 0.0f);
    for (const Cell& c : cells) heights.at(c.i, c.j) = std::numeric_limits<float>::quiet_NaN();
    HolePatch patch;
    std::vector<std::vector<float>> answers;
    for (int j = hole.low - reach; j <= hole.high + reach; ++j)
      for (int i = hole.left - reach; i <= hole.right + reach; ++i) {
        if (std::isnan(heights.at(i, j))) continue;
        std::vector<float> answer(cells.size());
        heights.at(i, j) = 1;
        patch.fill(heights, hole, answer.data());
        heights.at(i, j) = 0;
        if (std::all_of(answer.begin(), answer.end(), [](float a) { return a == 0; })) continue;
        shape.ring.push_back({i - cells[0].i, j - cells[0].j});
        answers.push_back(answer);
      }
    for (std::size_t k = 0; k < cells.size(); ++k)
      for (const std::vector<float>& answer : answers) shape.factors.push_back(answer[k]);
  };
  const Cell first{middle, middle};
  study({first});
  for (int a = wide / 2 + 1; a < places; ++a) {
    const Cell second{middle + a % wide - wide / 2, middle + a / wide};
    if (touch(first, second)) study({first, second});
    for (int b = a + 1; b < places; ++b) {
      const Cell third{middle + b % wide - wide / 2, middle + b / wide};
      if (touch(first, second) + touch(second, third) + touch(first, third) >= 2) study({first, second, third});
    }
  }
}

bool SmallHoles::fill(const Grid<float>& heights, const Hole& hole, float* out) const {
  const int which = number(hole);
  if (which < 0) return false;
  const bool inside = hole.left >= reach && hole.low >= reach && hole.right + reach < heights.nx && hole.high + reach < heights.ny;
  const Shape& shape = shapes_[static_cast<std::size_t>(which)];
  if (!inside || shape.ring.empty()) return false;
  const float* first = &heights.at(hole.cells[0].i, hole.cells[0].j);
  const double level = first[shape.ring[0].j * static_cast<long>(heights.nx) + shape.ring[0].i];
  const double* factor = shape.factors.data();
  for (int k = 0; k < hole.count; ++k) {
    double sum = 0;
    for (const Cell& c : shape.ring) sum += *factor++ * (first[c.j * static_cast<long>(heights.nx) + c.i] - level);
    if (std::isnan(sum)) return false;
    out[k] = static_cast<float>(level + sum);
  }
  return true;
}

}  // namespace debulk
