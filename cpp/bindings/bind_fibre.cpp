#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/core/pool.hpp"
#include "debulk/fibre/excess_field.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/segment.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {
namespace {

// The lines over one ply, with its outline.
struct FibreLines {
  std::vector<FibreLine> lines;
  Polygon ply;
  struct Kept {
    FibreMemory memory;
    std::shared_ptr<const Reference> mold;  // that the memory knows
  };
  std::unique_ptr<Pool<Kept>> kept = std::make_unique<Pool<Kept>>();  // from one scan to the next
};

Box box_of(const Array<double>& corners) {
  const auto rows = points<2>(corners, "box_mm");
  require(rows.size() == 2, "box_mm", "the lowest and the highest corner", shape_of(corners));
  return {rows[0], rows[1]};
}

Polygon polygon_of(const std::optional<Array<double>>& outline) {
  return outline ? checked_polygon(points<2>(*outline, "ply_outline"), "ply_outline") : Polygon();
}

FibreLines straight(const std::array<double, 2>& angles, const std::optional<Array<double>>& outline, const Array<double>& corners,
                    const FibreOptions& options) {
  FibreLines out;
  out.ply = polygon_of(outline);
  out.lines = straight_lines(angles, out.ply, box_of(corners), options);
  return out;
}

FibreLines along_field(const Array<double>& angles, const Eigen::Vector2d& origin, double spacing,
                       const std::optional<Array<double>>& outline, const Array<double>& corners, const FibreOptions& options,
                       const Stop& stop) {
  require(angles.ndim() == 3 && angles.shape(2) == 2, "fibre_angles_deg", "an (ny, nx, 2) array", shape_of(angles));
  AngleField field(static_cast<int>(angles.shape(1)), static_cast<int>(angles.shape(0)), origin, spacing, Eigen::Vector2d::Zero());
  if (field.size() > 0) std::memcpy(static_cast<void*>(field.values.data()), angles.data(), field.size() * sizeof(Eigen::Vector2d));
  FibreLines out;
  out.ply = polygon_of(outline);
  const Box box = box_of(corners);
  const py::gil_scoped_release release;
  out.lines = field_lines(field, out.ply, box, options, stop);
  return out;
}

ExcessField measure(const FibreLines& lines, const py::object& heights, const std::shared_ptr<Reference>& mold, bool whole,
                    const FibreOptions& options, const Stop& stop) {
  const Grid<float>& given =
      py::isinstance<Segmentation>(heights) ? heights.cast<const Segmentation&>().heights : heights.cast<const Grid<float>&>();
  const py::gil_scoped_release release;
  const auto kept = lines.kept->borrow();
  if (kept->mold != mold) *kept = {{}, mold};
  return measure_excess(lines.lines, given, lines.ply, *mold, whole, options, kept->memory, stop);
}

// One column of the runs.
template <class T, class Get>
py::array_t<T> column(const ExcessField& field, Get get) {
  std::vector<T> out;
  out.reserve(field.runs.size());
  for (const FibreRun& run : field.runs) out.push_back(get(run));
  const auto count = static_cast<py::ssize_t>(out.size());
  return to_array(std::move(out), {count});
}

template <class T, class Get>
py::array_t<T> pairs(const ExcessField& field, Get get) {
  std::vector<T> out;
  out.reserve(2 * field.runs.size());
  for (const FibreRun& run : field.runs)
    for (const int k : {0, 1}) out.push_back(get(run, k));
  const auto count = static_cast<py::ssize_t>(field.runs.size());
  return to_array(std::move(out), {count, 2});
}

py::dict columns(const ExcessField& field) {
  py::dict out;
  out["family"] = column<std::uint8_t>(field, [](const FibreRun& r) { return static_cast<std::uint8_t>(r.family); });
  out["line"] = column<std::int32_t>(field, [](const FibreRun& r) { return r.line; });
  out["spans"] = column<std::int32_t>(field, [](const FibreRun& r) { return r.spans; });
  out["from_mm"] = pairs<double>(field, [](const FibreRun& r, int k) { return r.from[k]; });
  out["to_mm"] = pairs<double>(field, [](const FibreRun& r, int k) { return r.to[k]; });
  out["top_mm"] = pairs<double>(field, [](const FibreRun& r, int k) { return r.top[k]; });
  out["gap_mm"] = column<double>(field, [](const FibreRun& r) { return r.gap; });
  out["length_mm"] = column<double>(field, [](const FibreRun& r) { return r.length; });
  out["flat_mm"] = column<double>(field, [](const FibreRun& r) { return r.flat; });
  out["low_mm"] = column<double>(field, [](const FibreRun& r) { return r.excess.low; });
  out["excess_mm"] = column<double>(field, [](const FibreRun& r) { return r.excess.mid; });
  out["high_mm"] = column<double>(field, [](const FibreRun& r) { return r.excess.high; });
  out["uncertainty_mm"] = column<double>(field, [](const FibreRun& r) { return r.uncertainty; });
  out["turn_mm"] = column<double>(field, [](const FibreRun& r) { return r.turn; });
  out["ends"] = pairs<std::uint8_t>(field, [](const FibreRun& r, int k) { return static_cast<std::uint8_t>(r.ends[std::size_t(k)]); });
  out["beyond_mm"] = pairs<double>(field, [](const FibreRun& r, int k) { return r.beyond[std::size_t(k)]; });
  return out;
}

template <class T>
py::tuple map_of(const Grid<T>& grid) {
  std::vector<T> values = grid.values;
  return py::make_tuple(to_array(std::move(values), {grid.ny, grid.nx}), py::array_t<double>(2, grid.origin.data()), grid.spacing);
}

}  // namespace

void bind_fibre(py::module_ m) {
  py::class_<FibreOptions>(m, "FibreOptions")
      .def(py::init<>())
      .def_readwrite("thickness_mm", &FibreOptions::thickness)
      .def_readwrite("mold_tol_mm", &FibreOptions::mold_tol)
      .def_readwrite("apart_mm", &FibreOptions::apart)
      .def_readwrite("step_mm", &FibreOptions::step)
      .def_readwrite("fine_mm", &FibreOptions::fine_mm)
      .def_readwrite("blur_cells2", &FibreOptions::blur_cells2)
      .def_readwrite("draw_mm", &FibreOptions::draw)
      .def_readwrite("hold_mm", &FibreOptions::hold)
      .def_readwrite("edge_cells", &FibreOptions::edge_cells)
      .def_readwrite("threads", &FibreOptions::threads);

  py::class_<FibreLines>(m, "FibreLines").def("__len__", [](const FibreLines& lines) { return lines.lines.size(); });

  py::class_<Grid<float>>(m, "Heights")
      .def(py::init([](const Array<float>& values, const Eigen::Vector2d& origin, double spacing) {
             return to_grid(values, origin, spacing, "height_map");
           }),
           py::arg("values"), py::arg("origin_mm"), py::arg("spacing_mm"));

  py::class_<ExcessField>(m, "ExcessField")
      .def_property_readonly("columns", &columns)
      .def_property_readonly("largest", [](const ExcessField& field) { return map_of(field.largest); })
      .def_property_readonly("family", [](const ExcessField& field) { return map_of(field.family); })
      .def_property_readonly("flat_mm", [](const ExcessField& field) { return field.noise.length; })
      .def_property_readonly("noise_per_mm", [](const ExcessField& field) { return field.noise.fine_per_mm(); })
      .def_property_readonly("noise_mm", [](const ExcessField& field) { return std::sqrt(field.noise.gap_variance()); });

  m.def(
      "crossings",
      [](const FibreLines& lines, const ExcessField& field, const FootMap& feet) {
        std::vector<std::int32_t> out;
        for (const FootCrossing& c : foot_crossings(lines.lines, field.runs, feet.labels)) out.insert(out.end(), {c.run, c.label});
        const auto count = static_cast<py::ssize_t>(out.size() / 2);
        return to_array(std::move(out), {count, 2});
      },
      py::arg("lines"), py::arg("field"), py::arg("feet"));
  m.def("straight_lines", &straight, py::arg("angles_rad"), py::arg("ply_outline").none(true), py::arg("box_mm"), py::arg("options"));
  m.def("field_lines", &along_field, py::arg("angles_rad"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("ply_outline").none(true),
        py::arg("box_mm"), py::arg("options"), py::arg("stop"));
  m.def("measure_excess", &measure, py::arg("lines"), py::arg("heights"), py::arg("mold"), py::arg("whole"), py::arg("options"),
        py::arg("stop"));
}

}  // namespace debulk
