#include "debulk/cloud/tree_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <tuple>

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "debulk/cloud/neighbours.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

using PclPoints = pcl::PointCloud<pcl::PointXYZ>;

constexpr std::size_t slab_points = 100'000;  // about; points of nearly the same x stay together
constexpr std::size_t between_checks = 65536;
constexpr int key_bits = 20;

// The upper bits of a coordinate, such that a larger coordinate never has the smaller key, wherever the cloud lies and
// however far off a stray point is. They resolve about half a millimetre at a metre.
std::uint32_t key(float x) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  bits = bits >> 31 ? ~bits : bits | 0x80000000u;
  return bits >> (32 - key_bits);
}

void check(std::size_t k, const Stop& stop) {
  if (k % between_checks == 0 && stop.now()) throw Stopped("the search for neighbours was stopped");
}

// Squared distances to points farther off than this overflow, and FLANN then cuts off branches that hold neighbours.
// Such points are in no tree and count as infinitely far from all others.
constexpr float farthest = 1e18f;

enum class Seen { no, near, far };

// Reads a point of the cloud once.
Seen read(const CloudView& cloud, std::size_t i, pcl::PointXYZ& p) {
  const float *from = cloud.point(i), x = from[0], y = from[1], z = from[2];
  p = {x, y, z};
  if (!std::isfinite(x + y + z)) return Seen::no;
  return std::max({std::abs(x), std::abs(y), std::abs(z)}) <= farthest ? Seen::near : Seen::far;
}

// Keeps at most `copies` copies of one point. FLANN visits every copy on each search, so that a million copies would
// take a million times a million steps, and more than `neighbours` + 1 copies change no distance.
void drop_copies(PclPoints& points, std::size_t copies) {
  auto& p = points.points;
  std::sort(p.begin(), p.end(), [](const auto& a, const auto& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); });
  const auto same = [](const auto& a, const auto& b) { return a.x == b.x && a.y == b.y && a.z == b.z; };
  std::size_t kept = 0;
  for (const pcl::PointXYZ& point : p)
    if (kept < copies || !same(p[kept - copies], point)) p[kept++] = point;
  p.resize(kept);
  points.width = static_cast<std::uint32_t>(kept);
  points.height = 1;
}

// The smallest `most` of both, ascending.
void merge(std::vector<float>& nearest, const std::vector<float>& others, std::size_t most, std::vector<float>& scratch) {
  scratch.resize(nearest.size() + others.size());
  std::merge(nearest.begin(), nearest.end(), others.begin(), others.end(), scratch.begin());
  scratch.resize(std::min(scratch.size(), most));
  nearest.swap(scratch);
}

}  // namespace

struct TreeSearch::Slab {
  PclPoints::Ptr points = std::make_shared<PclPoints>();
  pcl::KdTreeFLANN<pcl::PointXYZ> tree{true};
  float low = 0, high = 0;  // least and largest x

  void build(std::size_t copies) {
    drop_copies(*points, copies);
    low = points->front().x, high = points->back().x;
    tree.setInputCloud(points);
  }
};

TreeSearch::TreeSearch(const CloudView& cloud, int neighbours, int threads, const Stop& stop) : cloud_(cloud), neighbours_(neighbours) {
  std::vector<std::uint32_t> counts(std::size_t{1} << key_bits, 0), slab_of(counts.size(), 0);
  pcl::PointXYZ p;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    check(i, stop);
    if (read(cloud, i, p) == Seen::near) ++counts[key(p.x)];
  }
  std::vector<std::size_t> sizes{0};
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (sizes.back() >= slab_points) sizes.push_back(0);
    slab_of[k] = static_cast<std::uint32_t>(sizes.size() - 1);
    sizes.back() += counts[k];
  }
  std::vector<Slab> slabs(sizes.size());
  for (std::size_t s = 0; s < slabs.size(); ++s) slabs[s].points->points.reserve(sizes[s]);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    check(i, stop);
    if (read(cloud, i, p) == Seen::near) slabs[slab_of[key(p.x)]].points->points.push_back(p);
  }
  slabs.erase(std::remove_if(slabs.begin(), slabs.end(), [](const Slab& s) { return s.points->points.empty(); }), slabs.end());
  slabs_ = std::move(slabs);
  parallel_for(static_cast<long>(slabs_.size()), 1, threads, stop,
               [&](long begin, long) { slabs_[static_cast<std::size_t>(begin)].build(static_cast<std::size_t>(neighbours) + 1); });
}

TreeSearch::~TreeSearch() = default;

void TreeSearch::mean_distances(const std::vector<std::uint32_t>& which, float* means, int threads, const Stop& stop) const {
  const auto most = static_cast<std::size_t>(neighbours_) + 1;
  parallel_for(static_cast<long>(which.size()), 4096, threads, stop, [&](long begin, long end) {
    pcl::Indices indices;
    std::vector<float> nearest, others, scratch;
    pcl::PointXYZ p;
    for (long k = begin; k < end; ++k) {
      if (k % 256 == 0 && stop.now()) throw Stopped("the search for neighbours was stopped");
      const std::uint32_t i = which[static_cast<std::size_t>(k)];
      const Seen seen = read(cloud_, i, p);
      if (seen == Seen::far) means[i] = std::numeric_limits<float>::infinity();
      if (seen != Seen::near || slabs_.empty()) continue;
      auto home = std::upper_bound(slabs_.begin(), slabs_.end(), p.x, [](float x, const Slab& s) { return x < s.low; });
      if (home != slabs_.begin()) --home;
      home->tree.nearestKSearch(p, static_cast<int>(most), indices, nearest);
      const auto look = [&](const Slab& slab, float gap) {
        if (nearest.size() == most && gap * gap >= nearest.back()) return false;
        slab.tree.nearestKSearch(p, static_cast<int>(most), indices, others);
        merge(nearest, others, most, scratch);
        return true;
      };
      for (auto s = home; s != slabs_.begin() && look(*(s - 1), p.x - (s - 1)->high);) --s;
      for (auto s = home + 1; s != slabs_.end() && look(*s, s->low - p.x);) ++s;
      // The first found is the point itself, or a copy of it, which gives the same result.
      means[i] = mean_distance(nearest.data() + 1, static_cast<int>(nearest.size()) - 1);
    }
  });
}

}  // namespace debulk
