#include "debulk/region/windows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace debulk {
namespace {

constexpr int side = MeshPass::tile_side;
constexpr long largest = 24 * 24;  // most blocks of a rectangle, so that each thread has work and a stop is seen soon
constexpr int snap = 16;           // points; the length of the stretches of ImageGridding
constexpr float highest = 100.0F;  // mm

// Sets xy to the mold's XY at a pixel corner, for a point `height` mm above the base; returns false outside the base.
bool place(const RayBase& base, const View& view, int column, int row, double height, Eigen::Vector2d& xy) {
  const std::size_t at = static_cast<std::size_t>(std::min(row / base.step, base.ny - 1)) * static_cast<std::size_t>(base.nx) +
                         static_cast<std::size_t>(std::min(column / base.step, base.nx - 1));
  const double depth = base.depth[at] + height / base.gain[at];
  if (!std::isfinite(depth)) return false;
  const Eigen::Vector3d ray(view.camera.u(column), view.camera.v(row), 1);
  xy = (view.rotation() * ray * depth + view.centre()).head<2>();
  return true;
}

// Returns the height of the highest cell of a tile, mm; a run of flying pixels counts too.
double top_of(const MeshPass& pass, int ti, int tj, int row_step) {
  constexpr int across = side / MeshPass::cell_columns;
  float top = 0;
  for (int j = tj * side / row_step; j < std::min(pass.cells_y(), (tj + 1) * side / row_step); ++j)
    for (int i = 0; i < across; ++i) {
      const float h = pass.cell_height()[static_cast<std::size_t>(j) * static_cast<std::size_t>(pass.cell_pitch()) +
                                         static_cast<std::size_t>(ti * across + i)];
      top = h > top ? h : top;
    }
  return std::min(top, highest);
}

}  // namespace

std::vector<Window> merged(std::vector<Window> windows) {
  for (bool again = true; again;) {
    again = false;
    for (std::size_t a = 0; a < windows.size(); ++a)
      for (std::size_t b = windows.size() - 1; b > a; --b) {
        if (!windows[a].overlaps(windows[b])) continue;
        Window& w = windows[a];
        const Window& o = windows[b];
        w = {std::min(w.i0, o.i0), std::min(w.j0, o.j0), std::max(w.i1, o.i1), std::max(w.j1, o.j1), std::max(w.top, o.top)};
        windows.erase(windows.begin() + static_cast<long>(b));
        again = true;
      }
  }
  std::sort(windows.begin(), windows.end(), [](const Window& a, const Window& b) { return a.j0 != b.j0 ? a.j0 < b.j0 : a.i0 < b.i0; });
  return windows;
}

Window grown(const Window& window, int points, int nx, int ny) {
  const auto down = [](int v) { return std::max(0, v / snap * snap); };
  const auto up = [](int v, int last) { return std::min(last, (v + snap - 1) / snap * snap); };
  return {down(std::max(0, window.i0 - points)), down(std::max(0, window.j0 - points)), up(window.i1 + points, nx),
          up(window.j1 + points, ny), window.top};
}

Blocks::Blocks(const Grid<float>& frame)
    : nx(frame.nx), ny(frame.ny), top((frame.nx + side - 1) / side, (frame.ny + side - 1) / side, frame.origin, side * frame.spacing, -1) {}

void Blocks::add(const Window& points, double height) {
  for (int j = std::max(0, points.j0) / side; j < std::min(top.ny, (points.j1 + side - 1) / side); ++j)
    for (int i = std::max(0, points.i0) / side; i < std::min(top.nx, (points.i1 + side - 1) / side); ++i)
      top.at(i, j) = std::max(top.at(i, j), static_cast<float>(std::max(height, 0.0)));
}

std::vector<Window> Blocks::rectangles(const Window& window, double margin) const {
  const auto cost = [&](const Window& w) { return (side * (w.i1 - w.i0) + 2 * margin) * (side * (w.j1 - w.j0) + 2 * margin); };
  const auto join = [](const Window& a, const Window& b) -> Window {
    return {std::min(a.i0, b.i0), std::min(a.j0, b.j0), std::max(a.i1, b.i1), std::max(a.j1, b.j1), std::max(a.top, b.top)};
  };
  std::vector<Window> out, open{{window.i0 / side, window.j0 / side, (window.i1 + side - 1) / side, (window.j1 + side - 1) / side}};
  while (!open.empty()) {
    const Window w = open.back();
    open.pop_back();
    const Window none{w.i1, w.j1, w.i0, w.j0, -1};
    // The bounds of the wanted blocks in each column and row.
    std::vector<Window> columns(static_cast<std::size_t>(w.i1 - w.i0), none), rows(static_cast<std::size_t>(w.j1 - w.j0), none);
    for (int j = w.j0; j < w.j1; ++j)
      for (int i = w.i0; i < w.i1; ++i) {
        if (!wanted(i, j)) continue;
        const Window block{i, j, i + 1, j + 1, top.at(i, j)};
        Window &column = columns[static_cast<std::size_t>(i - w.i0)], &row = rows[static_cast<std::size_t>(j - w.j0)];
        column = join(column, block), row = join(row, block);
      }
    const Window whole = std::accumulate(rows.begin(), rows.end(), none, join);
    if (whole.top < 0) continue;
    // Make the cut that saves most; a rectangle that is too large is cut near its middle.
    const bool too_large = whole.size() > largest;
    double best = too_large ? std::numeric_limits<double>::infinity() : cost(whole);
    Window first = none, second = none;
    for (const std::vector<Window>* lines : {&columns, &rows}) {
      std::vector<Window> behind(*lines);
      for (std::size_t k = behind.size() - 1; k-- > 0;) behind[k] = join(behind[k], behind[k + 1]);
      Window before = none;
      for (std::size_t k = 0; k + 1 < lines->size(); ++k) {
        before = join(before, (*lines)[k]);
        if (before.top < 0 || behind[k + 1].top < 0 || (too_large && (3 * k < lines->size() || 3 * k > 2 * lines->size()))) continue;
        const double both = cost(before) + cost(behind[k + 1]);
        if (both < best) best = both, first = before, second = behind[k + 1];
      }
    }
    if (first.top >= 0) {
      open.push_back(second), open.push_back(first);
      continue;
    }
    out.push_back({whole.i0 * side, whole.j0 * side, std::min(whole.i1 * side, nx), std::min(whole.j1 * side, ny), whole.top});
  }
  return out;
}

std::vector<Window> find_windows(const MeshPass& pass, const Mesh& mesh, const RayBase& base, const View& view,
                                 const std::vector<std::uint8_t>& tile_near, const Grid<float>& frame, const WindowOptions& options,
                                 Blocks& blocks) {
  const int row_step = mesh.row_step, margin = static_cast<int>(std::ceil(options.margin_mm / frame.spacing));
  const int nx = pass.tiles_x(), ny = pass.tiles_y();
  std::vector<std::uint8_t> taken(pass.tile_high().size(), 0);
  std::vector<Window> out;
  std::vector<int> open;
  for (std::size_t first = 0; first < taken.size(); ++first) {
    if (!pass.tile_high()[first] || taken[first]) continue;
    Window window{frame.nx, frame.ny, 0, 0, 0};
    open.assign(1, static_cast<int>(first));
    taken[first] = 1;
    while (!open.empty()) {
      const int tile = open.back(), ti = tile % nx, tj = tile / nx;
      open.pop_back();
      const double here = top_of(pass, ti, tj, row_step);
      Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
      for (const double height : {0.0, here})
        for (int corner = 0; corner < 4; ++corner) {
          Eigen::Vector2d xy;
          if (!place(base, view, (ti + corner % 2) * side, (tj + corner / 2) * side, height, xy)) continue;
          low = low.cwiseMin(xy), high = high.cwiseMax(xy);
        }
      const Eigen::Vector2d a = frame.locate(low), b = frame.locate(high);
      if (a.allFinite() && b.allFinite() && a.cwiseAbs().maxCoeff() < 1e6 && b.cwiseAbs().maxCoeff() < 1e6) {
        const Window points = grown({static_cast<int>(std::floor(a.x())), static_cast<int>(std::floor(a.y())),
                                     static_cast<int>(std::ceil(b.x())) + 1, static_cast<int>(std::ceil(b.y())) + 1, here},
                                    margin, frame.nx, frame.ny);
        if (points.i0 < points.i1 && points.j0 < points.j1) {
          blocks.add(points, here);
          window = {std::min(window.i0, points.i0), std::min(window.j0, points.j0), std::max(window.i1, points.i1),
                    std::max(window.j1, points.j1), std::max(window.top, here)};
        }
      }
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
          const int i = ti + di, j = tj + dj;
          if (i < 0 || j < 0 || i >= nx || j >= ny) continue;
          const std::size_t k = static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
          if (taken[k] || !tile_near[k] || !(pass.tile_high()[k] || pass.tile_height()[k] > options.low_mm)) continue;
          taken[k] = 1;
          open.push_back(static_cast<int>(k));
        }
    }
    if (window.i0 < window.i1 && window.j0 < window.j1) out.push_back(window);
  }
  return merged(std::move(out));
}

}  // namespace debulk
