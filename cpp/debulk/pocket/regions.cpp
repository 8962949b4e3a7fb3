#include "debulk/pocket/regions.hpp"

namespace debulk {
namespace {

constexpr int kDi[8] = {1, -1, 0, 0, 1, 1, -1, -1};
constexpr int kDj[8] = {0, 0, 1, -1, 1, -1, 1, -1};

// Gives `to` to every point that is reached from (i, j) over points with the value `from`, itself included.
template <class T>
void flood(Grid<T>& grid, int i, int j, int neighbours, T from, T to, std::vector<std::size_t>& stack) {
  grid.at(i, j) = to;
  stack.assign(1, grid.index(i, j));
  while (!stack.empty()) {
    const int pi = static_cast<int>(stack.back() % grid.nx), pj = static_cast<int>(stack.back() / grid.nx);
    stack.pop_back();
    for (int k = 0; k < neighbours; ++k) {
      const int qi = pi + kDi[k], qj = pj + kDj[k];
      if (!grid.contains(qi, qj) || grid.at(qi, qj) != from) continue;
      grid.at(qi, qj) = to;
      stack.push_back(grid.index(qi, qj));
    }
  }
}

}  // namespace

Grid<std::uint8_t> fill_holes(const Grid<std::uint8_t>& foreground) {
  constexpr std::uint8_t hole = 0, solid = 1, outside = 2;
  Grid<std::uint8_t> image = foreground;
  for (std::uint8_t& v : image.values) v = v ? solid : hole;
  std::vector<std::size_t> stack;
  const auto drain = [&](int i, int j) {
    if (image.at(i, j) == hole) flood(image, i, j, 4, hole, outside, stack);
  };
  for (int i = 0; i < image.nx; ++i) drain(i, 0), drain(i, image.ny - 1);
  for (int j = 0; j < image.ny; ++j) drain(0, j), drain(image.nx - 1, j);
  for (std::uint8_t& v : image.values) v = v != outside;
  return image;
}

Grid<std::int32_t> connected_components(const Grid<std::uint8_t>& foreground, int& count) {
  constexpr std::int32_t unvisited = -1;
  auto labels = foreground.like<std::int32_t>();
  for (std::size_t k = 0; k < labels.size(); ++k) labels.values[k] = foreground.values[k] ? unvisited : 0;
  count = 0;
  std::vector<std::size_t> stack;
  for (int j = 0; j < labels.ny; ++j)
    for (int i = 0; i < labels.nx; ++i)
      if (labels.at(i, j) == unvisited) flood(labels, i, j, 8, unvisited, std::int32_t(++count), stack);
  return labels;
}

}  // namespace debulk
