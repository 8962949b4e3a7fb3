#include "debulk/cloud/tree_search.hpp"

#include <algorithm>
#include <tuple>

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "debulk/cloud/neighbours.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

using PclPoints = pcl::PointCloud<pcl::PointXYZ>;

// The points to put into the tree: of copies of one point, `copies` at most. FLANN visits every copy on each search, so
// that a million copies would take a million times a million steps; and more than `neighbours` + 1 change no distance.
PclPoints::Ptr seen_points(const CloudView& cloud, std::size_t copies) {
  const PclPoints::Ptr points(new PclPoints);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (cloud.seen(i)) points->points.emplace_back(cloud.point(i)[0], cloud.point(i)[1], cloud.point(i)[2]);
  auto& p = points->points;
  std::sort(p.begin(), p.end(), [](const auto& a, const auto& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); });
  const auto same = [](const auto& a, const auto& b) { return a.x == b.x && a.y == b.y && a.z == b.z; };
  std::size_t kept = 0;
  for (const pcl::PointXYZ& point : p)
    if (kept < copies || !same(p[kept - copies], point)) p[kept++] = point;
  p.resize(kept);
  points->width = static_cast<std::uint32_t>(kept);
  points->height = 1;
  return points;
}

}  // namespace

struct TreeSearch::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> kd{true};
};

TreeSearch::TreeSearch(const CloudView& cloud, int neighbours) : cloud_(cloud), neighbours_(neighbours), tree_(std::make_unique<Tree>()) {
  const PclPoints::Ptr points = seen_points(cloud, static_cast<std::size_t>(neighbours) + 1);
  if (!points->empty()) tree_->kd.setInputCloud(points);
}

TreeSearch::~TreeSearch() = default;

void TreeSearch::mean_distances(const std::vector<std::uint32_t>& which, float* means, int threads, const Stop& stop) const {
  parallel_for(static_cast<long>(which.size()), 4096, threads, [&](long begin, long end) {
    if (stop.now()) throw Stopped("the search for neighbours was stopped");
    pcl::Indices indices;
    std::vector<float> squared;
    for (long k = begin; k < end; ++k) {
      const std::uint32_t i = which[static_cast<std::size_t>(k)];
      const float* p = cloud_.point(i);
      // The first found is the point itself, or a copy of it, which comes to the same.
      const int found = tree_->kd.nearestKSearch({p[0], p[1], p[2]}, neighbours_ + 1, indices, squared);
      means[i] = mean_distance(squared.data() + 1, found - 1);
    }
  });
}

}  // namespace debulk
