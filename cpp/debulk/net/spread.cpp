#include "debulk/net/spread.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <utility>
#include <vector>

namespace debulk {
namespace {

// Marks of the places that were seen on an unbounded lattice; its memory grows from the middle outwards.
class Marks {
 public:
  // Marks a place; returns whether it was not marked yet.
  bool add(int i, int j) {
    while (std::max(std::abs(i), std::abs(j)) > reach_) widen();
    std::uint8_t& mark = marks_[index(i, j, reach_)];
    return std::exchange(mark, 1) == 0;
  }

 private:
  static std::size_t index(int i, int j, int reach) {
    return static_cast<std::size_t>(j + reach) * static_cast<std::size_t>(2 * reach + 1) + static_cast<std::size_t>(i + reach);
  }

  void widen() {
    const int wider = 2 * reach_;
    std::vector<std::uint8_t> marks(index(wider, wider, wider) + 1, 0);
    for (int j = -reach_; j <= reach_; ++j)
      std::copy_n(marks_.begin() + static_cast<long>(index(-reach_, j, reach_)), 2 * reach_ + 1,
                  marks.begin() + static_cast<long>(index(-reach_, j, wider)));
    reach_ = wider, marks_ = std::move(marks);
  }

  int reach_ = 16;
  std::vector<std::uint8_t> marks_ = std::vector<std::uint8_t>(index(16, 16, 16) + 1, 0);
};

}  // namespace

void spread(NetLayer& layer, const std::function<bool(int, int, const Eigen::Vector3d&)>& visit) {
  constexpr int steps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};  // by Direction
  std::vector<std::array<int, 2>> reached;
  Marks seen;
  const auto reach = [&](int i, int j) {
    if (!seen.add(i, j)) return;
    const Eigen::Vector3d* node = layer.at(i, j);
    if (node != nullptr && visit(i, j, *node)) reached.push_back({i, j});
  };
  reach(0, 0);
  for (std::size_t k = 0; k < reached.size(); ++k)
    for (const auto& step : steps) reach(reached[k][0] + step[0], reached[k][1] + step[1]);
}

}  // namespace debulk
