#include <pybind11/stl.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "bindings/pocket_modes.hpp"
#include "debulk/net/area.hpp"
#include "debulk/net/drape.hpp"
#include "debulk/net/fibre_net.hpp"
#include "debulk/net/held_rim.hpp"
#include "debulk/net/lay_pocket.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {
namespace {

using Outline = std::vector<Eigen::Vector2d>;

Outline outline_of(const std::optional<Array<double>>& corners, const char* argument) {
  if (!corners) return {};
  Outline out = points<2>(*corners, argument);
  require(!out.empty(), argument, "at least 3 corners", "none");  // because the core takes an empty outline to mean that none is given
  return out;
}

constexpr const char* kPathRules[] = {"geodesic", "vertical_plane", "least_shear"};  // by PathRule

PathRule path_rule(const std::string& name) {
  const auto* found = std::find(std::begin(kPathRules), std::end(kPathRules), name);
  require(found != std::end(kPathRules), "paths", "\"geodesic\", \"vertical_plane\" or \"least_shear\"", "\"" + name + "\"");
  return static_cast<PathRule>(found - std::begin(kPathRules));
}

template <class T, std::size_t K>
py::array_t<T> rows_array(const std::vector<std::array<int, K>>& rows) {
  py::array_t<T> out({static_cast<py::ssize_t>(rows.size()), static_cast<py::ssize_t>(K)});
  T* to = out.mutable_data();
  for (const auto& row : rows) to = std::copy(row.begin(), row.end(), to);
  return out;
}

template <class T, class From>
py::array_t<T> column_array(const std::vector<From>& values) {
  py::array_t<T> out(static_cast<py::ssize_t>(values.size()));
  std::transform(values.begin(), values.end(), out.mutable_data(), [](From v) { return static_cast<T>(v); });
  return out;
}

py::array_t<double> drape_angles(const Drape& drape, const Array<double>& xy) {
  const Outline at = points<2>(xy, "xy_mm");
  Outline out(at.size(), Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
  {
    py::gil_scoped_release unlocked;
    for (std::size_t k = 0; k < at.size(); ++k)
      if (const auto angles = drape.fibre_angles(at[k])) out[k] = {(*angles)[0], (*angles)[1]};
  }
  return to_array(out);
}

}  // namespace

void bind_net(py::module_ m) {
  py::class_<Net>(m, "Net")
      .def_property_readonly("nodes", [](const Net& net) { return to_array(net.nodes); })
      .def_property_readonly("neighbours", [](const Net& net) { return rows_array<std::int32_t>(net.neighbours); })
      .def_property_readonly("kinds", [](const Net& net) { return column_array<std::int8_t>(net.kinds); })
      .def_property_readonly("inside", [](const Net& net) { return column_array<bool>(net.inside); })
      .def_property_readonly("lattice", [](const Net& net) { return rows_array<std::int32_t>(net.lattice); })
      .def_property_readonly("edges", [](const Net& net) { return rows_array<std::int32_t>(segments(net.neighbours)); })
      .def_property_readonly("shear", [](const Net& net) { return column_array<double>(shear_angles(net)); })
      .def_readonly("spacing", &Net::spacing);

  py::class_<PocketNet>(m, "PocketNet")
      .def_readonly("net", &PocketNet::net)
      .def_readonly("area", &PocketNet::area)
      .def_property_readonly("held_all_round", &PocketNet::held_all_round)
      .def_property_readonly("open_ends", [](const PocketNet& pocket) { return column_array<std::int32_t>(pocket.open_ends); });

  py::class_<FibreNetOptions>(m, "FibreNetOptions")
      .def(py::init<>())
      .def_readwrite("spacing_mm", &FibreNetOptions::spacing)
      .def_readwrite("node_target", &FibreNetOptions::node_target)
      .def_readwrite("free_edge_mm", &FibreNetOptions::edge_tol)
      .def_readwrite("mold_tol_mm", &FibreNetOptions::mold_tol)
      .def_property(
          "paths", [](const FibreNetOptions& o) { return kPathRules[static_cast<int>(o.paths)]; },
          [](FibreNetOptions& o, const std::string& name) { o.paths = path_rule(name); });

  py::class_<LayPocketOptions>(m, "LayPocketOptions")
      .def(py::init<>())
      .def_property(
          "mode", [](const LayPocketOptions& o) { return name_of(o.mode); },
          [](LayPocketOptions& o, const std::string& name) { o.mode = patch_mode(name); })
      .def_readwrite("net", &LayPocketOptions::net);

  m.def(
      "fibre_net",
      [](const Surface& surface, const Surface& reference, std::array<double, 2> centre, const FibreAngles& angles,
         const Array<double>& outline, const std::optional<Array<double>>& ply_outline, const std::optional<Array<double>>& rms_outline,
         const FibreNetOptions& options) {
        PocketShape shape;
        shape.centre = {centre[0], centre[1]};
        shape.angles = angles;
        shape.outline = outline_of(outline, "outline_mm");
        shape.ply_outline = outline_of(ply_outline, "ply_outline");
        shape.rms_outline = outline_of(rms_outline, "rms_outline_mm");
        py::gil_scoped_release unlocked;
        return fibre_net(surface, reference, shape, options);
      },
      py::arg("surface"), py::arg("reference"), py::arg("centre"), py::arg("angles"), py::arg("outline"), py::arg("ply_outline").none(true),
      py::arg("rms_outline").none(true), py::arg("options"));

  m.def(
      "lay_pocket",
      [](const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const FibreAngles& angles,
         const std::optional<Array<double>>& ply_outline, const LayPocketOptions& options, const Stop& stop) {
        const Outline ply = outline_of(ply_outline, "ply_outline");
        const py::gil_scoped_release unlocked;
        return lay_pocket(segmentation, feet, id, reference, angles, ply, options, stop);
      },
      py::arg("segmentation"), py::arg("feet"), py::arg("pocket_id"), py::arg("reference"), py::arg("angles"),
      py::arg("ply_outline").none(true), py::arg("options"), py::arg("stop"));

  m.def("with_rim_held", &with_rim_held, py::arg("laid"));

  m.def(
      "surface_area",
      [](const Surface& surface, const Array<double>& outline, const std::optional<Array<double>>& ply_outline) {
        const Outline within = outline_of(outline, "outline_mm"), ply = outline_of(ply_outline, "ply_outline");
        py::gil_scoped_release unlocked;
        return surface_area(surface, within, ply);
      },
      py::arg("surface"), py::arg("outline"), py::arg("ply_outline"));

  py::class_<Drape>(m, "Drape")
      .def(py::init([](const Surface& surface, std::array<double, 2> seed, const FibreAngles& angles, double spacing,
                       const Array<double>& outline, const std::string& paths) {
             const Outline ply = outline_of(outline, "outline_mm");
             LayOptions options;
             options.paths = path_rule(paths);
             py::gil_scoped_release unlocked;
             return std::make_unique<Drape>(surface, Eigen::Vector2d(seed[0], seed[1]), angles, spacing, ply, options);
           }),
           py::arg("surface"), py::arg("seed"), py::arg("angles"), py::arg("spacing"), py::kw_only(), py::arg("outline"), py::arg("paths"))
      .def_property_readonly("net", &Drape::net)
      .def("fibre_angles", &drape_angles, py::arg("xy"));
}

}  // namespace debulk
