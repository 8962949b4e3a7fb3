#include "debulk/net/net.hpp"

namespace debulk {

std::vector<std::array<int, 2>> segments(const std::vector<Neighbours>& neighbours) {
  std::vector<std::array<int, 2>> out;
  for (std::size_t i = 0; i < neighbours.size(); ++i)
    for (const int j : neighbours[i])
      if (j > static_cast<int>(i)) out.push_back({static_cast<int>(i), j});
  return out;
}

}  // namespace debulk
