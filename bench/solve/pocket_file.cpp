#include "solve/pocket_file.hpp"

#include <cstdlib>
#include <fstream>

#include "debulk/surface/reference.hpp"

namespace debulk::bench {

std::vector<Pocket> read_pockets(const std::string& path) {
  std::ifstream file(path);
  std::vector<Pocket> out;
  int count = 0;
  while (file >> count) {
    Pocket pocket;
    file >> pocket.net.spacing >> pocket.area_mm2;
    for (int i = 0; i < count; ++i) {
      Eigen::Vector3d p;
      Neighbours n;
      int kind = 0;
      file >> p.x() >> p.y() >> p.z() >> n[0] >> n[1] >> n[2] >> n[3] >> kind;
      pocket.net.nodes.push_back(p);
      pocket.net.neighbours.push_back(n);
      pocket.net.kinds.push_back(static_cast<NodeKind>(kind));
    }
    Grid<double> heights;
    file >> heights.nx >> heights.ny >> heights.origin.x() >> heights.origin.y() >> heights.spacing;
    heights.values.resize(static_cast<std::size_t>(heights.nx) * static_cast<std::size_t>(heights.ny));
    for (double& h : heights.values) file >> h;
    require(static_cast<bool>(file), "DEBULK_POCKETS", "a file written by export_pockets.py", path);
    pocket.mold = std::make_shared<Reference>(heights);
    out.push_back(std::move(pocket));
  }
  return out;
}

const std::vector<Pocket>& pockets() {
  static const std::vector<Pocket> all = [] {
    const char* path = std::getenv("DEBULK_POCKETS");
    return read_pockets(path ? path : "build/bench/pockets.txt");
  }();
  return all;
}

}  // namespace debulk::bench
