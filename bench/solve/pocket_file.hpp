#pragma once

#include <string>
#include <vector>

#include "debulk/sheet/sheet.hpp"

namespace debulk::bench {

// One pocket as export_pockets.py wrote it.
struct Pocket {
  Net net;
  double area_mm2 = 0;
  std::shared_ptr<const Surface> mold;

  Sheet sheet() const { return Sheet(net, area_mm2, PlyMaterial(), mold); }
};

// Those in the file; none where there is no such file.
std::vector<Pocket> read_pockets(const std::string& path);

// The layup's pockets, from the file that the environment variable DEBULK_POCKETS names, read once.
const std::vector<Pocket>& pockets();

}  // namespace debulk::bench
