#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/patch.hpp"
#include "debulk/pocket/segment.hpp"
#include "debulk/pocket/smooth.hpp"

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

// A read-only view of a grid's values; `owner` keeps them alive.
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

Segmentation segment_arrays(const Array<float>& heights, const Array<double>& origin, double spacing, double cut_height, double area_tol,
                            double peak_tol, double edge_tol, double bridge, double smooth, double blur,
                            const std::optional<Array<double>>& ply_outline, const std::optional<Array<std::uint8_t>>& measured,
                            const std::optional<Array<float>>& before_median, int threads, const Stop& stop) {
  SegmentOptions options;
  options.cut_height_mm = cut_height;
  options.area_tol_mm2 = area_tol;
  options.peak_tol_mm = peak_tol;
  options.edge_tol_mm = edge_tol;
  options.bridge_mm = bridge;
  options.smooth_mm = smooth;
  options.blur_mm2 = blur;
  if (ply_outline) options.ply_outline = points<2>(*ply_outline, "ply_outline");
  const py::gil_scoped_release release;
  const Grid<float> grid = to_grid(heights, origin_of(origin), spacing, "height_map");
  std::optional<Grid<std::uint8_t>> mask;
  if (measured) mask = to_grid(*measured, grid.origin, spacing, "measured");
  std::optional<Grid<float>> before;
  if (before_median) before = to_grid(*before_median, grid.origin, spacing, "before_median");
  return segment(grid, options, mask ? &*mask : nullptr, before ? &*before : nullptr, threads, stop);
}

FootMap find(const Segmentation& segmentation, double thickness, double mold_tol, double smooth, std::optional<double> noise, int threads,
             const Stop& stop) {
  return find_feet(segmentation, {thickness, mold_tol, smooth, noise}, threads, stop);
}

Patch patch_of(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const std::string& mode,
               double margin, double fade) {
  require(mode == "foot" || mode == "paper", "mode", "\"foot\" or \"paper\"", "\"" + mode + "\"");
  const py::gil_scoped_release release;
  return make_patch(segmentation, feet, id, reference, {mode == "paper" ? PatchMode::paper : PatchMode::foot, margin, fade});
}

py::array_t<double> distances(const Array<double>& polygon, const Array<double>& at) {
  const Polygon outline = points<2>(polygon, "outline_mm");
  std::vector<double> out;
  for (const Eigen::Vector2d& p : points<2>(at, "xy_mm")) out.push_back(distance_to_outline(outline, p));
  const auto count = static_cast<py::ssize_t>(out.size());
  return to_array(std::move(out), {count});
}

py::array_t<bool> insides(const Array<double>& polygon, const Array<double>& at) {
  const Polygon outline = points<2>(polygon, "outline_mm");
  const auto xy = points<2>(at, "xy_mm");
  py::array_t<bool> out(static_cast<py::ssize_t>(xy.size()));
  for (std::size_t k = 0; k < xy.size(); ++k) out.mutable_data()[k] = inside(outline, xy[k]);
  return out;
}

}  // namespace

void bind_pocket(py::module_& m) {
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
      .def_property_readonly("centroid", [](const Dropped& d) { return row(d.centroid); });

  py::class_<Segmentation, std::shared_ptr<Segmentation>>(m, "Segmentation")
      .def_readonly("pockets", &Segmentation::pockets)
      .def_readonly("dropped", &Segmentation::dropped)
      .def_readonly("specks", &Segmentation::specks)
      .def_property_readonly("origin", [](const Segmentation& s) { return row(s.heights.origin); })
      .def_property_readonly("spacing", [](const Segmentation& s) { return s.heights.spacing; })
      .def_property_readonly("labels", viewer(&Segmentation::labels))
      .def_property_readonly("heights", viewer(&Segmentation::heights));

  m.def("segment", &segment_arrays, py::arg("heights"), py::arg("origin_mm"), py::arg("spacing_mm"), py::kw_only(),
        py::arg("cut_height_mm"), py::arg("area_tol_mm2"), py::arg("peak_tol_mm"), py::arg("edge_tol_mm"), py::arg("bridge_mm"),
        py::arg("smooth_mm"), py::arg("blur_mm2"), py::arg("ply_outline").none(true), py::arg("measured").none(true),
        py::arg("before_median").none(true), py::arg("threads"), py::arg("stop"));

  py::class_<Foot>(m, "Foot")
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

  m.def("find_feet", &find, py::arg("segmentation"), py::kw_only(), py::arg("thickness_mm"), py::arg("mold_tol_mm"), py::arg("smooth_mm"),
        py::arg("noise_mm").none(true), py::arg("threads"), py::arg("stop"), py::call_guard<py::gil_scoped_release>());

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

  m.def("make_patch", &patch_of, py::arg("segmentation"), py::arg("feet"), py::arg("pocket_id"), py::arg("reference"), py::kw_only(),
        py::arg("mode"), py::arg("margin_mm"), py::arg("fade_mm"));

  m.def("height_noise", [](const Array<float>& heights) {
    const Grid<float> grid = to_grid(heights, Eigen::Vector2d::Zero(), 1.0, "height_map");
    const py::gil_scoped_release release;
    return height_noise(grid);
  });
  m.def("polygon_area", [](const Array<double>& outline) { return polygon_area(points<2>(outline, "outline_mm")); });
  m.def("inside_polygon", &insides, py::arg("outline_mm"), py::arg("xy_mm"));
  m.def("distance_to_outline", &distances, py::arg("outline_mm"), py::arg("xy_mm"));
}

}  // namespace debulk
