#include "debulk/rawscan/standing_wrinkles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/pocket/ply_mask.hpp"

namespace debulk {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

int pixels(double wanted) {
  return static_cast<int>(std::nearbyint(std::clamp(wanted, 2.0, 1e6)));
}

// A pixel of the image, by its line and its position along the line.
struct Place {
  int line = 0, at = 0;
};

}  // namespace

// The search along one direction, rows or columns, of one scan.
struct WrinkleFinder::Search {
  const WrinkleFinder& finder;
  const Lines lines;
  const WrinkleOptions& options;
  const double pitch;
  const int step = pixels(options.pairs_mm / pitch);
  const int side = pixels(options.side_mm / pitch);

  Eigen::Vector3d point(int line, int at) const {
    const std::size_t pixel = lines.pixel(line, std::clamp(at, 0, lines.length() - 1));
    if (lines.masked && lines.masked[pixel]) return Eigen::Vector3d::Constant(nan);
    return finder.moved(lines.cloud.point(pixel));
  }
  double above(int line, int at) const { return finder.above(point(line, at)); }

  // Returns the highest point at a crossing, on either line of the pair.
  Place top(const Crossing& c) const {
    Place best{c.pair * step, c.at - 2};
    double highest = -std::numeric_limits<double>::infinity();
    for (int k = 0; k < 2; ++k)
      for (int at = c.at - 2; at <= c.at + 2; ++at)
        if (const double here = above(c.pair * step + k, at); here > highest) highest = here, best = {c.pair * step + k, at};
    return best;
  }

  // Returns the number of consecutive pixels through a place that are higher than half its height.
  int run_through(const Place& place, double height) const {
    const auto stands = [&](int off) { return above(place.line, place.at + off) > 0.5 * height; };
    int begin = 0, end = 0;
    while (begin > -side && stands(begin - 1)) --begin;
    while (end < side && stands(end + 1)) ++end;
    return end - begin + 1;
  }

  // Returns the height of a place above the mean of the two points beside it; if one was not seen, above the other.
  double rise(int line, int at, double height) const {
    const double left = above(line, at - side), right = above(line, at + side);
    if (std::isnan(left) && std::isnan(right)) return height;
    return height - (std::isnan(left) ? right : std::isnan(right) ? left : 0.5 * (left + right));
  }

  // Whether in most of the lines between the first and the last place a point near the crest stands out. It must stand
  // out from the points beside it, because a pocket below lifts the whole way.
  bool solid(const std::vector<Place>& good) const {
    std::vector<double> rises;
    for (const Place& place : good) rises.push_back(rise(place.line, place.at, above(place.line, place.at)));
    const double whole = median(rises);
    const double least = std::max(0.25 * whole, std::min(0.5 * whole, options.stands_out_mm));
    int stand = 0, sunk = 0;
    std::size_t k = 0;
    for (int line = good.front().line; line <= good.back().line; ++line) {
      while (k + 2 < good.size() && good[k + 1].line <= line) ++k;
      const Place &a = good[k], &b = good[k + 1];
      const double slope = static_cast<double>(b.at - a.at) / (b.line - a.line);
      const int way = static_cast<int>(std::nearbyint(a.at + slope * (line - a.line)));
      bool stands = false, sinks = false;
      for (int at = way - 3; at <= way + 3; ++at) {
        const double here = rise(line, way, above(line, at));
        stands = stands || here > least;
        sinks = sinks || here < -0.25 * whole;
      }
      stand += stands, sunk += sinks;
    }
    const double between = good.back().line - good.front().line + 1;
    return stand / between >= options.solid_share && sunk / between <= options.sunk_share;
  }

  std::optional<StandingWrinkle> measured(const std::vector<Crossing>& crossings, const std::vector<int>& chain) const {
    std::vector<Place> good;
    std::vector<double> heights;
    for (const int index : chain) {
      const Place place = top(crossings[static_cast<std::size_t>(index)]);
      const double middle = above(place.line, place.at);
      const double beside = std::fmax(above(place.line, place.at - side), above(place.line, place.at + side));
      if (!(middle - beside > options.contrast * middle && middle > options.stands_out_mm)) continue;
      good.push_back(place), heights.push_back(middle);
    }
    if (static_cast<int>(good.size()) < options.links) return std::nullopt;
    StandingWrinkle out;
    out.height = median(heights);
    std::vector<double> widths;
    for (std::size_t k = 0; k < good.size(); ++k) {
      widths.push_back(run_through(good[k], heights[k]));
      out.along.push_back(point(good[k].line, good[k].at).head<2>());
    }
    Eigen::Vector2d low = out.along.front(), high = low;
    for (const Eigen::Vector2d& p : out.along) low = low.cwiseMin(p), high = high.cwiseMax(p);
    const double across = (high - low).norm() / std::max(1.0, (good.back().line - good.front().line) * pitch);
    out.width = median(widths) * pitch / std::max(1.0, across);  // because the lines cross the wrinkle at an angle
    if (out.width > options.widest_mm || !solid(good)) return std::nullopt;
    return out;
  }

  // Returns false if there are too many crossings.
  bool add_to(std::vector<StandingWrinkle>& out, const Stop& stop) const {
    CrossingOptions crossing;
    crossing.step = step, crossing.side = side;
    crossing.up_per_depth = static_cast<float>(finder.pose_(2, 2));
    crossing.stands_out_mm = static_cast<float>(options.stands_out_mm), crossing.highest_mm = static_cast<float>(options.highest_mm);
    std::vector<Crossing> crossings = find_crossings(lines, crossing, finder.threads_, stop);
    if (static_cast<long>(crossings.size()) > options.most) {
      const auto off = [&](const Crossing& c) { return finder.known(point(c.pair * step, c.at)) < 2; };
      crossings.erase(std::remove_if(crossings.begin(), crossings.end(), off), crossings.end());
    }
    if (static_cast<long>(crossings.size()) > options.most) return false;
    ChainOptions linking;
    linking.step = step, linking.links = options.links;
    const std::vector<std::vector<int>> chains = link_crossings(crossings, linking, stop);
    std::vector<std::optional<StandingWrinkle>> found(chains.size());
    parallel_for(static_cast<long>(chains.size()), 4, finder.threads_, stop, [&](long begin, long end) {
      for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) found[k] = measured(crossings, chains[k]);
    });
    for (std::optional<StandingWrinkle>& one : found)
      if (one) out.push_back(std::move(*one));
    return true;
  }
};

WrinkleFinder::WrinkleFinder(std::shared_ptr<const Reference> reference, const Grid<float>& seen, const Eigen::Matrix4d& mold_from_scanner,
                             const Polygon& ply_outline, int threads)
    : reference_(std::move(reference)), pose_(mold_from_scanner), known_(seen.like<std::uint8_t>()), threads_(threads) {
  const PlyMask ply = ply_outline.empty() ? PlyMask() : PlyMask(checked_polygon(ply_outline, "ply_outline"), seen);
  for (int j = 0; j < seen.ny; ++j)
    for (int i = 0; i < seen.nx; ++i)
      if (std::isfinite(seen.at(i, j))) known_.at(i, j) = ply.on_ply(i, j) ? 2 : 1;
}

Eigen::Vector3d WrinkleFinder::moved(const float* point) const {
  return pose_.topLeftCorner<3, 3>() * Eigen::Vector3d(point[0], point[1], point[2]) + pose_.topRightCorner<3, 1>();
}

std::uint8_t WrinkleFinder::known(const Eigen::Vector3d& point) const {
  const Eigen::Vector2d cell = known_.locate(point.head<2>());
  const double i = std::nearbyint(cell.x()), j = std::nearbyint(cell.y());
  const bool inside = i >= 0 && j >= 0 && i < known_.nx && j < known_.ny;  // false for NaN
  return inside ? known_.at(static_cast<int>(i), static_cast<int>(j)) : std::uint8_t{0};
}

double WrinkleFinder::above(const Eigen::Vector3d& point) const {
  return known(point) == 0 ? nan : point.z() - reference_->height(point.head<2>());
}

StandingWrinkles WrinkleFinder::find(const CloudView& scan, const std::uint8_t* masked, double pitch, const WrinkleOptions& options,
                                     const Stop& stop) const {
  require(pitch > 0, "pitch_mm", "a positive length in mm", pitch);
  StandingWrinkles out;
  for (const bool turned : {false, true})
    out.gave_up = !Search{*this, {scan, masked, turned}, options, pitch}.add_to(out.wrinkles, stop) || out.gave_up;
  return out;
}

}  // namespace debulk
