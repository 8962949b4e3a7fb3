#include "debulk/pocket/foot_excess.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "debulk/pocket/nearest_marked.hpp"

namespace debulk {
namespace {

constexpr double kSpreadPastEdge = 1.5;  // mm

// Falls from 1 at u = 0 to 0 at u = 1 and beyond, with a slope of 0 at both ends.
double fade(double u) {
  return u >= 1 ? 0.0 : (1 - u) * (1 - u) * (1 + 2 * u);
}

// A rectangle of the window's points, all of them included.
struct Extent {
  int left, right, bottom, top;
};

// The points within the region, and those round it as far as `reach`; nothing if the region is empty.
std::optional<Extent> extent_of(const Grid<std::uint8_t>& within, int reach) {
  Extent e{within.nx, -1, within.ny, -1};
  for (int j = 0; j < within.ny; ++j) {
    const std::uint8_t *row = &within.at(0, j), *end = row + within.nx, *first = std::find(row, end, 1);
    if (first == end) continue;
    while (end[-1] == 0) --end;
    e.left = std::min(e.left, static_cast<int>(first - row)), e.right = std::max(e.right, static_cast<int>(end - row) - 1);
    e.bottom = std::min(e.bottom, j), e.top = j;
  }
  if (e.right < 0) return std::nullopt;
  return Extent{std::max(e.left - reach, 0), std::min(e.right + reach, within.nx - 1), std::max(e.bottom - reach, 0),
                std::min(e.top + reach, within.ny - 1)};
}

// The height of the ply's lower side above F, in a rectangle of the window.
class FootExcess {
 public:
  FootExcess(const PatchWindow& window, const Grid<std::uint8_t>& within, const Extent& extent)
      : window_(window),
        within_(within),
        extent_(extent),
        t_(window.feet.options.thickness_mm),
        marked_(extent.right - extent.left + 1, extent.top - extent.bottom + 1, within.position(extent.left, extent.bottom),
                within.spacing),
        above_(marked_.like<double>()) {}

  // Takes the heights that were measured within the region, and marks their points. Those beside the ply's edge do not
  // count, because they may be partly the mold's.
  void measure() {
    measure(false);
    const bool strip = std::find(marked_.values.begin(), marked_.values.end(), 1) == marked_.values.end();
    if (strip) measure(true);  // along the edge, and no wider than the points beside it
  }

  // Gives the other points the height of the nearest marked one, which falls to 0 over `fade_mm` outside the region, and
  // over `past_edge_mm` past the ply's edge. A point within that was seen is not lowered.
  void spread(int reach, double fade_mm, double past_edge_mm) {
    const int farthest = all_marked_ ? reach : Offset::kNone;
    const std::vector<std::vector<Columns>> unmarked = unmarked_within(marked_, farthest);
    const Grid<Offset> nearest = nearest_marked(marked_, unmarked, farthest);
    std::vector<std::size_t> past_edge;
    std::vector<double> fades;  // of these points
    for (int j = extent_.bottom; j <= extent_.top; ++j)
      for (const Columns& columns : unmarked[static_cast<std::size_t>(j - extent_.bottom)])
        for (int i = extent_.left + columns.begin; i < extent_.left + columns.end; ++i) {
          const Offset o = nearest.at(i - extent_.left, j - extent_.bottom);
          if (!o.found()) continue;
          const bool past = window_.off_ply(i, j) || window_.at_edge(i, j);
          // The heights that count end about a point before the edge.
          const double width = past ? past_edge_mm : fade_mm;
          const double away = std::sqrt(o.squared()) * within_.spacing - (past ? within_.spacing : 0.0);
          if (!within_.at(i, j) && away >= width) continue;
          const double faded = within_.at(i, j) ? 1.0 : fade(away / width);
          double& here = above(i, j);
          here = beside_marked(i, j, o, past);
          if (past && i > extent_.left && i < extent_.right && j > extent_.bottom && j < extent_.top) {
            past_edge.push_back(static_cast<std::size_t>(&here - above_.values.data()));
            fades.push_back(faded);
          } else {
            here *= faded;
          }
        }
    relax(past_edge, kSpreadPastEdge, above_);
    for (std::size_t k = 0; k < past_edge.size(); ++k) above_.values[past_edge[k]] *= fades[k];
  }

  void add_to(Grid<double>& surface) const {
    for (int j = extent_.bottom; j <= extent_.top; ++j)
      for (int i = extent_.left; i <= extent_.right; ++i) surface.at(i, j) += above_.at(i - extent_.left, j - extent_.bottom);
  }

 private:
  double& above(int i, int j) { return above_.at(i - extent_.left, j - extent_.bottom); }

  void measure(bool edge_too) {
    for (int j = std::max(extent_.bottom, -window_.j0); j <= std::min(extent_.top, window_.feet.heights.ny - 1 - window_.j0); ++j) {
      const std::uint8_t *in = &within_.at(0, j), *on_ply = window_.segmentation.ply.row(j + window_.j0);
      const float* height = &window_.feet.heights.at(0, j + window_.j0);
      for (int i = extent_.left; i <= extent_.right; ++i) {
        if (!in[i]) continue;  // points off the map are not within, either
        const bool known = !std::isnan(height[i + window_.i0]) && (!on_ply || on_ply[i + window_.i0]);
        const bool counts = known && (edge_too || !window_.at_edge(i, j));
        all_marked_ = all_marked_ && counts;
        if (!counts) continue;
        marked_.at(i - extent_.left, j - extent_.bottom) = 1;
        above(i, j) = std::max(height[i + window_.i0] - t_, 0.0);
      }
    }
  }

  // The height of an unmarked point from that of the nearest marked one, before it fades.
  double beside_marked(int i, int j, const Offset& o, bool past) const {
    const double marked = std::max(window_.height(i + o.i, j + o.j) - t_, 0.0);
    if (!window_.known(i, j)) return marked;
    const double own = window_.height(i, j) - t_;
    if (within_.at(i, j)) return std::max(own, marked);  // the mold in a point at the edge only lowers it
    return past ? marked : std::clamp(own, 0.0, marked);
  }

  // Each point past the ply's edge takes the height of one point near the edge. These heights scatter, because their
  // fits are one-sided, and the streaks that this leaves would bend a fibre's path that runs along the edge. So the
  // heights at `places` relax towards the mean of their neighbours, in as many Gauss-Seidel sweeps as spread a point's
  // height over about the length `spread`.
  static void relax(const std::vector<std::size_t>& places, double spread, Grid<double>& heights) {
    const auto across = static_cast<std::size_t>(heights.nx);
    double* z = heights.values.data();
    const auto mean = [&](std::size_t k) { z[k] = 0.25 * (z[k - 1] + z[k + 1] + z[k - across] + z[k + across]); };
    const double cells = spread / heights.spacing;
    for (int sweep = static_cast<int>(std::ceil(cells * cells)); sweep > 0; --sweep) {
      if (sweep % 2 == 0)
        std::for_each(places.begin(), places.end(), mean);
      else
        std::for_each(places.rbegin(), places.rend(), mean);
    }
  }

  const PatchWindow& window_;
  const Grid<std::uint8_t>& within_;
  const Extent extent_;
  const double t_;
  Grid<std::uint8_t> marked_;
  Grid<double> above_;
  bool all_marked_ = true;  // of the points within
};

}  // namespace

void add_foot_excess(const PatchWindow& window, const Grid<std::uint8_t>& within, const PatchOptions& options, Grid<double>& surface) {
  const double past_edge_mm = std::max(options.margin_mm, options.fade_mm);
  const int reach = static_cast<int>(std::ceil((window.ply.known() ? past_edge_mm : options.fade_mm) / within.spacing));
  const std::optional<Extent> extent = extent_of(within, reach);
  if (!extent) return;
  FootExcess excess(window, within, *extent);
  excess.measure();
  excess.spread(reach, options.fade_mm, past_edge_mm);
  excess.add_to(surface);
}

}  // namespace debulk
