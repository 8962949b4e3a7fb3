#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "bindings/pocket_modes.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/height_noise.hpp"
#include "debulk/pocket/humps.hpp"
#include "debulk/pocket/outline_search.hpp"
#include "debulk/pocket/patch.hpp"
#include "debulk/pocket/ply_mask.hpp"
#include "debulk/pocket/pocket_finder.hpp"
#include "debulk/pocket/segment.hpp"
#include "debulk/pocket/unseen.hpp"
#include "debulk/surface/front_end.hpp"

namespace debulk {
namespace {

Eigen::Vector2d origin_of(const Array<double>& origin) {
  require(origin.ndim() == 1 && origin.shape(0) == 2, "origin_mm", "an array of shape (2,)", shape_of(origin));
  return {origin.at(0), origin.at(1)};
}

py::array_t<double> row(const Eigen::Vector2d& v) {
  return py::array_t<double>(2, v.data());
}

py::array_t<double> rows(const Box& box) {
  return to_array<2>({box.low, box.high});
}

// Returns a read-only view of a grid's values; `owner` keeps them alive.
template <class T>
py::array_t<T> view(const Grid<T>& grid, const py::object& owner) {
  py::array_t<T> out({static_cast<py::ssize_t>(grid.ny), static_cast<py::ssize_t>(grid.nx)}, grid.values.data(), owner);
  out.attr("flags").attr("writeable") = false;
  return out;
}

template <class Owner, class T>
auto viewer(Grid<T> Owner::* grid) {
  return [grid](const py::object& self) { return view(self.cast<const Owner&>().*grid, self); };
}

const char* name_of(Dropped::Reason reason) {
  switch (reason) {
    case Dropped::Reason::area:
      return "area";
    case Dropped::Reason::peak:
      return "peak";
    case Dropped::Reason::area_and_peak:
      break;
  }
  return "area and peak";
}

Segmentation segment_arrays(const Array<float>& heights, const Array<double>& origin, double spacing, const SegmentOptions& options,
                            const std::optional<Array<std::uint8_t>>& measured, const std::optional<Array<float>>& before_median,
                            int threads, const Stop& stop) {
  const Grid<float> grid = to_grid(heights, origin_of(origin), spacing, "height_map");
  std::optional<Grid<std::uint8_t>> mask;
  if (measured) mask = to_grid(*measured, grid.origin, spacing, "measured");
  std::optional<Grid<float>> before;
  if (before_median) before = to_grid(*before_median, grid.origin, spacing, "before_median");
  const py::gil_scoped_release release;
  return segment(grid, options, mask ? &*mask : nullptr, before ? &*before : nullptr, threads, stop);
}

py::array_t<double> distances(const Array<double>& polygon, const Array<double>& at) {
  const OutlineSearch outline(points<2>(polygon, "outline_mm"));
  std::vector<double> out;
  for (const Eigen::Vector2d& p : points<2>(at, "xy_mm")) out.push_back(outline.distance(p));
  const auto count = static_cast<py::ssize_t>(out.size());
  return to_array(std::move(out), {count});
}

py::array_t<bool> insides(const Array<double>& polygon, const Array<double>& at) {
  const OutlineSearch outline(points<2>(polygon, "outline_mm"));
  const auto xy = points<2>(at, "xy_mm");
  py::array_t<bool> out(static_cast<py::ssize_t>(xy.size()));
  for (std::size_t k = 0; k < xy.size(); ++k) out.mutable_data()[k] = outline.inside(xy[k]);
  return out;
}

py::array_t<bool> insides_on_grid(const Array<double>& polygon, const Array<double>& origin, double spacing, int nx, int ny) {
  const PlyMask mask(points<2>(polygon, "outline_mm"), nx, ny, origin_of(origin), spacing);
  py::array_t<bool> out({ny, nx});
  for (int j = 0; j < ny; ++j) std::copy_n(mask.row(j), nx, out.mutable_data() + static_cast<std::ptrdiff_t>(j) * nx);
  return out;
}

void bind_options(py::module_ m) {
  py::class_<SegmentOptions>(m, "SegmentOptions")
      .def(py::init<>())
      .def_readwrite("cut_height_mm", &SegmentOptions::cut_height_mm)
      .def_readwrite("area_tol_mm2", &SegmentOptions::area_tol_mm2)
      .def_readwrite("peak_tol_mm", &SegmentOptions::peak_tol_mm)
      .def_readwrite("edge_tol_mm", &SegmentOptions::edge_tol_mm)
      .def_readwrite("bridge_mm", &SegmentOptions::bridge_mm)
      .def_readwrite("smooth_mm", &SegmentOptions::smooth_mm)
      .def_readwrite("blur_mm2", &SegmentOptions::blur_mm2)
      .def_property(
          "ply_outline",
          [](const SegmentOptions& o) -> std::optional<py::array_t<double>> {
            if (!o.ply_outline) return std::nullopt;
            return to_array<2>(*o.ply_outline);
          },
          [](SegmentOptions& o, const std::optional<Array<double>>& outline) {
            o.ply_outline.reset();
            if (outline) o.ply_outline = points<2>(*outline, "ply_outline");
          });

  py::class_<FootOptions>(m, "FootOptions")
      .def(py::init<>())
      .def_readwrite("thickness_mm", &FootOptions::thickness_mm)
      .def_readwrite("mold_tol_mm", &FootOptions::mold_tol_mm)
      .def_readwrite("smooth_mm", &FootOptions::smooth_mm)
      .def_readwrite("noise_mm", &FootOptions::noise_mm);

  py::class_<UnseenOptions>(m, "UnseenOptions")
      .def(py::init<>())
      .def_readwrite("area_tol_mm2", &UnseenOptions::area_tol_mm2)
      .def_property(
          "ply_outline",
          [](const UnseenOptions& o) -> std::optional<py::array_t<double>> {
            if (!o.ply_outline) return std::nullopt;
            return to_array<2>(*o.ply_outline);
          },
          [](UnseenOptions& o, const std::optional<Array<double>>& outline) {
            o.ply_outline.reset();
            if (outline) o.ply_outline = points<2>(*outline, "ply_outline");
          });

  py::class_<PatchOptions>(m, "PatchOptions")
      .def(py::init<>())
      .def_property(
          "mode", [](const PatchOptions& o) { return name_of(o.mode); },
          [](PatchOptions& o, const std::string& name) { o.mode = patch_mode(name); })
      .def_readwrite("margin_mm", &PatchOptions::margin_mm)
      .def_readwrite("fade_mm", &PatchOptions::fade_mm);
}

// 1 in the runs, else 0.
Grid<std::uint8_t> marks_of(std::initializer_list<const std::vector<Run>*> lists, const Grid<float>& like) {
  Grid<std::uint8_t> out = like.like<std::uint8_t>();
  for (const std::vector<Run>* runs : lists)
    for (const Run& run : *runs) std::fill(&out.at(run.begin, run.row), &out.at(run.begin, run.row) + (run.end - run.begin), 1);
  return out;
}

}  // namespace

void bind_pocket(py::module_ m) {
  bind_options(m);

  py::class_<Pocket>(m, "Pocket")
      .def_readonly("id", &Pocket::id)
      .def_property_readonly("outline", [](const Pocket& p) { return to_array<2>(p.outline); })
      .def_readonly("area", &Pocket::area)
      .def_readonly("volume", &Pocket::volume)
      .def_readonly("peak", &Pocket::peak)
      .def_property_readonly("peak_position", [](const Pocket& p) { return row(p.peak_position); })
      .def_property_readonly("centroid", [](const Pocket& p) { return row(p.centroid); })
      .def_property_readonly("box", [](const Pocket& p) { return rows(p.box); })
      .def_readonly("touches_ply_edge", &Pocket::touches_ply_edge)
      .def_readonly("touches_unknown", &Pocket::touches_unknown)
      .def_readonly("measured_share", &Pocket::measured_share);

  py::class_<Dropped>(m, "DroppedPocket")
      .def_property_readonly("reason", [](const Dropped& d) { return name_of(d.reason); })
      .def_readonly("area", &Dropped::area)
      .def_readonly("peak", &Dropped::peak)
      .def_property_readonly("centroid", [](const Dropped& d) { return row(d.centroid); })
      .def_readonly("touches_unknown", &Dropped::touches_unknown);

  py::class_<UnseenHole>(m, "UnseenHole")
      .def_property_readonly("centre", [](const UnseenHole& h) { return row(h.centre); })
      .def_property_readonly("box", [](const UnseenHole& h) { return rows(h.box); })
      .def_readonly("area", &UnseenHole::area)
      .def_readonly("thickness", &UnseenHole::thickness)
      .def_readonly("rim_height", &UnseenHole::rim_height)
      .def_readonly("reference_share", &UnseenHole::reference_share)
      .def_readonly("at_ply_edge", &UnseenHole::at_ply_edge)
      .def_readonly("filled", &UnseenHole::filled);

  py::class_<Unseen>(m, "Unseen")
      .def_readonly("coverage", &Unseen::coverage)
      .def_readonly("reference_coverage", &Unseen::reference_coverage)
      .def_readonly("holes", &Unseen::holes)
      .def_readonly("smaller", &Unseen::smaller)
      .def_readonly("smaller_area", &Unseen::smaller_area);

  py::class_<Segmentation, std::shared_ptr<Segmentation>>(m, "Segmentation")
      .def_readonly("pockets", &Segmentation::pockets)
      .def_readonly("dropped", &Segmentation::dropped)
      .def_readonly("specks", &Segmentation::specks)
      .def_property_readonly("cut_height", [](const Segmentation& s) { return s.options.cut_height_mm; })
      .def_property_readonly("blur_mm2", [](const Segmentation& s) { return s.options.blur_mm2; })
      .def_property_readonly("bridged", [](const Segmentation& s) { return grid_values(marks_of({&s.bridged}, s.heights)); })
      .def_property_readonly("unmeasured",  // bridged, filled in before, or unknown
                             [](const Segmentation& s) { return grid_values(marks_of({&s.bridged, &s.unmeasured}, s.heights)); })
      .def_property_readonly("origin", [](const Segmentation& s) { return row(s.heights.origin); })
      .def_property_readonly("spacing", [](const Segmentation& s) { return s.heights.spacing; })
      .def_property_readonly("labels", viewer(&Segmentation::labels))
      .def_property_readonly("heights", viewer(&Segmentation::heights));

  m.def("segment", &segment_arrays, py::arg("heights"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("options"),
        py::arg("measured").none(true), py::arg("before_median").none(true), py::arg("threads"), py::arg("stop"));

  // The overview of the front end's last scan: heights as (values, origin, spacing), and the areas that were not seen.
  m.def(
      "find_unseen",
      [](const FrontEnd& front, const UnseenOptions& options) {
        Overview map;
        Unseen unseen;
        {
          const py::gil_scoped_release release;
          map = front.overview();
          unseen = find_unseen(map, options);
        }
        const Eigen::Vector2d origin = map.heights.origin;
        const double spacing = map.heights.spacing;
        return py::make_tuple(grid_values(std::move(map.heights)), row(origin), spacing, unseen);
      },
      py::arg("front"), py::arg("options"));

  py::class_<Foot>(m, "Foot")
      .def_readonly("label", &Foot::label)
      .def_property_readonly("outline", [](const Foot& f) { return to_array<2>(f.outline); })
      .def_readonly("area", &Foot::area)
      .def_property_readonly("box", [](const Foot& f) { return rows(f.box); })
      .def_readonly("closed", &Foot::closed)
      .def_readonly("touches_ply_edge", &Foot::touches_ply_edge)
      .def_readonly("parted", &Foot::parted);

  py::class_<FootMap, std::shared_ptr<FootMap>>(m, "FootMap")
      .def_readonly("feet", &FootMap::feet)
      .def_property_readonly("labels", viewer(&FootMap::labels))
      .def_property_readonly("heights", viewer(&FootMap::heights))
      .def_readonly("noise", &FootMap::noise_mm)
      .def_readonly("mold_tol", &FootMap::mold_tol_mm);

  m.def("find_feet", py::overload_cast<const Segmentation&, const FootOptions&, int, const Stop&>(&find_feet), py::arg("segmentation"),
        py::arg("options"), py::arg("threads"), py::arg("stop"), py::call_guard<py::gil_scoped_release>());

  py::class_<PocketFinder>(m, "PocketFinder")
      .def(py::init<>())
      // The pockets of the front end's last scan, and their feet. Their memory is reused by the first run that begins
      // when nobody holds them any more.
      .def(
          "run",
          [](PocketFinder& finder, const FrontEnd& front, SegmentOptions pockets, const FootOptions& feet, int threads, const Stop& stop) {
            pockets.blur_mm2 = front.blur_mm2();
            std::shared_ptr<FoundPockets> found;  // Python's views are read-only
            {
              const py::gil_scoped_release release;
              found = std::const_pointer_cast<FoundPockets>(finder.run(front.map(), pockets, feet, threads, stop));
            }
            return py::make_tuple(std::shared_ptr<Segmentation>(found, &found->segmentation),
                                  std::shared_ptr<FootMap>(found, &found->feet));
          },
          py::arg("front"), py::arg("pockets"), py::arg("feet"), py::arg("threads"), py::arg("stop"));

  py::class_<Patch>(m, "Patch")
      .def_property_readonly("outline", [](const Patch& p) { return to_array<2>(p.outline); })
      .def_readonly("area", &Patch::area)
      .def_readonly("closed", &Patch::closed)
      .def_readonly("touches_ply_edge", &Patch::touches_ply_edge)
      .def_readonly("parted", &Patch::parted)
      .def_property_readonly("origin", [](const Patch& p) { return row(p.surface.origin); })
      .def_property_readonly("spacing", [](const Patch& p) { return p.surface.spacing; })
      .def_property_readonly("surface", viewer(&Patch::surface))
      .def_property_readonly("reference", viewer(&Patch::reference))
      .def_property_readonly("within", viewer(&Patch::within));

  m.def("make_patch", &make_patch, py::arg("segmentation"), py::arg("feet"), py::arg("pocket_id"), py::arg("reference"), py::arg("options"),
        py::call_guard<py::gil_scoped_release>());

  py::class_<Hump>(m, "Hump")
      .def_property_readonly("top", [](const Hump& h) { return row(h.top); })
      .def_readonly("height", &Hump::height)
      .def_readonly("area", &Hump::area)
      .def_readonly("excess", &Hump::excess)
      .def_readonly("cell", &Hump::cell);

  m.def(
      "find_humps",
      [](const Array<float>& heights, const Array<double>& origin, double spacing, const std::optional<Array<double>>& outline,
         const std::vector<double>& angles, const Stop& stop) {
        const Grid<float> seen = to_grid(heights, origin_of(origin), spacing, "heights");
        const Polygon ply = outline ? points<2>(*outline, "ply_outline") : Polygon();
        const py::gil_scoped_release release;
        return find_humps(seen, ply, angles, stop);
      },
      py::arg("heights"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("ply_outline").none(true), py::arg("angles_deg"),
      py::arg("stop"));

  m.def("height_noise", [](const Array<float>& heights) {
    const Grid<float> grid = to_grid(heights, Eigen::Vector2d::Zero(), 1.0, "height_map");
    const py::gil_scoped_release release;
    return height_noise(grid);
  });
  m.def("polygon_area", [](const Array<double>& outline) { return polygon_area(points<2>(outline, "outline_mm")); });
  m.def("rings", [](const Array<double>& outline) {
    std::vector<std::pair<std::size_t, std::size_t>> out;
    for (const Ring& ring : rings(points<2>(outline, "outline_mm"))) out.emplace_back(ring.begin, ring.end);
    return out;
  });
  m.def("inside_polygon", &insides, py::arg("outline_mm"), py::arg("xy_mm"));
  m.def("inside_on_grid", &insides_on_grid, py::arg("outline_mm"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("nx"),
        py::arg("ny"));
  m.def("distance_to_outline", &distances, py::arg("outline_mm"), py::arg("xy_mm"));
}

}  // namespace debulk
