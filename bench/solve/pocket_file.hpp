#pragma once

#include <string>
#include <vector>

#include "debulk/sheet/sheet.hpp"

namespace debulk::bench {

// One pocket as written by export_pockets.py.
struct Pocket {
  Net net;
  double area_mm2 = 0;
  std::shared_ptr<const Surface> mold;

  Sheet sheet() const { return Sheet(net, area_mm2, PlyMaterial(), mold); }
};

// Returns the pockets in the file; none if there is no such file.
std::vector<Pocket> read_pockets(const std::string& path);

// Returns the layup's pockets from the file named by the environment variable DEBULK_POCKETS (build/bench/pockets.txt
// if it is not set), which is read once.
const std::vector<Pocket>& pockets();

}  // namespace debulk::bench
