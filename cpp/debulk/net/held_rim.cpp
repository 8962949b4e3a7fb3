#include "debulk/net/held_rim.hpp"

#include <algorithm>

namespace debulk {

PocketNet with_rim_held(const PocketNet& laid) {
  PocketNet out = laid;
  Net& net = out.net;
  for (std::size_t i = 0; i < laid.past_ends.size(); ++i) {
    if (net.kinds[i] != NodeKind::free) continue;
    if (laid.past_ends[i] > net.spacing) net.kinds[i] = NodeKind::fixed;
    net.to_edge[i] = std::max(net.to_edge[i], laid.past_ends[i]);
  }
  return out;
}

}  // namespace debulk
