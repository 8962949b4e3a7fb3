#include <pybind11/stl.h>

#include <optional>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/net/fibre_net.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/ridge/bridge_section.hpp"
#include "debulk/ridge/excess_crest.hpp"
#include "debulk/ridge/held_excess.hpp"
#include "debulk/ridge/mold_length.hpp"
#include "debulk/ridge/post_process.hpp"
#include "debulk/ridge/ridge_height.hpp"
#include "debulk/ridge/string_bound.hpp"
#include "debulk/sheet/minimise.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {
namespace {

std::vector<Neighbours> neighbours_of(const Array<int>& a) {
  require(a.ndim() == 2 && a.shape(1) == 4, "neighbours", "an (N, 4) array", shape_of(a));
  std::vector<Neighbours> out(static_cast<std::size_t>(a.shape(0)));
  if (!out.empty()) std::memcpy(out.data(), a.data(), out.size() * sizeof(Neighbours));
  return out;
}

std::vector<std::uint8_t> flags_of(const Array<bool>& a, const char* name) {
  require(a.ndim() == 1, name, "an (N,) array", shape_of(a));
  return std::vector<std::uint8_t>(a.data(), a.data() + a.size());
}

PostProcessed post_process_arrays(const Array<double>& nodes, const Array<int>& neighbours, const Array<bool>& inside,
                                  const Surface& surface, const RidgeOptions& options) {
  const auto node_rows = points<3>(nodes, "nodes_mm");
  const auto neighbour_rows = neighbours_of(neighbours);
  const auto inside_flags = flags_of(inside, "inside");
  py::gil_scoped_release release;
  return post_process(node_rows, neighbour_rows, inside_flags, surface, options);
}

double largest_excess_of_arrays(const Array<double>& nodes, const Array<int>& neighbours, const Surface& surface) {
  const auto node_rows = points<3>(nodes, "nodes_mm");
  const auto neighbour_rows = neighbours_of(neighbours);
  py::gil_scoped_release release;
  return largest_fibre_excess(node_rows, neighbour_rows, surface);
}

}  // namespace

void bind_ridge(py::module_ m) {
  py::class_<RidgeOptions>(m, "RidgeOptions")
      .def(py::init<>())
      .def_readwrite("thickness_mm", &RidgeOptions::thickness)
      .def_readwrite("bulk_factor", &RidgeOptions::bulk_factor)
      .def_readwrite("touch_mm", &RidgeOptions::touch)
      .def_property_readonly("touch_gap_mm", &RidgeOptions::touch_gap);

  py::class_<RidgeSection>(m, "RidgeSection")
      .def_readonly("peak", &RidgeSection::peak)
      .def_readonly("fibre", &RidgeSection::fibre)
      .def_readonly("nodes", &RidgeSection::nodes)
      .def_readonly("ply_length_mm", &RidgeSection::ply_length)
      .def_readonly("mold_length_mm", &RidgeSection::mold_length)
      .def_readonly("height_mm", &RidgeSection::height)
      .def_readonly("length_mm", &RidgeSection::length);

  py::class_<PostProcessed>(m, "PostProcessed")
      .def_property_readonly("gap_mm",
                             [](const PostProcessed& p) { return to_array(std::vector<double>(p.gaps), {py::ssize_t(p.gaps.size())}); })
      .def_property_readonly(
          "is_ridge",
          [](const PostProcessed& p) { return to_array(std::vector<std::uint8_t>(p.is_ridge), {py::ssize_t(p.is_ridge.size())}); })
      .def_property_readonly(
          "is_bridge",
          [](const PostProcessed& p) { return to_array(std::vector<std::uint8_t>(p.is_bridge), {py::ssize_t(p.is_bridge.size())}); })
      .def_readonly("sections", &PostProcessed::sections)
      .def_readonly("ridge_height_mm", &PostProcessed::ridge_height)
      .def_readonly("ridge_length_mm", &PostProcessed::ridge_length)
      .def_readonly("bridge_height_mm", &PostProcessed::bridge_height)
      .def_property_readonly(
          "is_drawn_in",
          [](const PostProcessed& p) { return to_array(std::vector<std::uint8_t>(p.drawn_in), {py::ssize_t(p.drawn_in.size())}); })
      .def_readonly("drawn_in_height_mm", &PostProcessed::drawn_in_height)
      .def_property_readonly("drawn_in_tension_n_per_mm", [](const PostProcessed& p) { return p.drawn_in_pull.tension; })
      .def_property_readonly("drawn_in_hold_n_per_mm", [](const PostProcessed& p) { return p.drawn_in_pull.most; })
      .def_readonly("rms_mm", &PostProcessed::rms)
      .def_readonly("excess_length_mm", &PostProcessed::excess_length);

  py::class_<HeldExcess>(m, "HeldExcess").def_readonly("fibres", &HeldExcess::fibres).def_readonly("largest_mm", &HeldExcess::largest);
  m.def("held_excess", &held_excess, py::arg("net"), py::arg("mold"), py::call_guard<py::gil_scoped_release>());
  m.def(
      "string_bound",
      [](const Foot& foot, double around, const FibreAngles& angles, const Surface& mold) {
        const py::gil_scoped_release release;
        return string_bound(foot.outline, around, angles, mold);
      },
      py::arg("foot"), py::arg("around_mm"), py::arg("angles"), py::arg("mold"));

  py::class_<ExcessCrest>(m, "ExcessCrest")
      .def_property_readonly("line_mm", [](const ExcessCrest& crest) { return to_array(crest.line); })
      .def_property_readonly("mirrored_mm", [](const ExcessCrest& crest) { return to_array(crest.mirrored); })
      .def_readonly("peak", &ExcessCrest::peak);
  m.def("excess_crest", &excess_crest, py::arg("net"), py::arg("mold"), py::call_guard<py::gil_scoped_release>());

  py::class_<BridgeSection>(m, "BridgeSection")
      .def_readonly("gap_mm", &BridgeSection::gap)
      .def_readonly("least_gap_mm", &BridgeSection::least_gap)
      .def_readonly("most_gap_mm", &BridgeSection::most_gap)
      .def_readonly("lacks_mm", &BridgeSection::lacks)
      .def_readonly("error_mm", &BridgeSection::error)
      .def_readonly("pull_n_per_mm", &BridgeSection::pull)
      .def_readonly("hold_n_per_mm", &BridgeSection::hold);
  m.def(
      "bridge_section",
      [](const Array<double>& rows, const Reference& mold, const std::optional<Array<double>>& ply, const PlyMaterial& held,
         const Stop& stop) {
        std::vector<ShortFibre> fibres;
        for (const auto& row : points<7>(rows, "fibres_mm")) fibres.push_back({row.head<2>(), row.segment<2>(2), row[4], row[5], row[6]});
        const Grid<double>& known = mold.heights();
        const BridgeSectionOptions options{held.friction,
                                           held.pressure_mpa,
                                           ply ? points<2>(*ply, "ply_outline_mm") : Polygon(),
                                           {known.origin, known.position(known.nx - 1, known.ny - 1)}};
        const py::gil_scoped_release release;
        return bridge_section(fibres, mold, options, stop);
      },
      py::arg("fibres_mm"), py::arg("mold"), py::arg("ply_outline_mm"), py::arg("held"), py::arg("stop"));

  m.def("ridge_height_of_excess", py::vectorize(&ridge_height_of_excess), py::arg("excess_mm"), py::arg("thickness_mm"));
  m.def("ridge_height", &ridge_height, py::arg("ply_length_mm"), py::arg("mold_length_mm"), py::arg("thickness_mm"));
  m.def("post_process", &post_process_arrays, py::arg("nodes_mm"), py::arg("neighbours"), py::arg("inside"), py::arg("surface"),
        py::arg("options"));
  m.def(
      "post_process",
      [](const Minimum& minimum, const PocketNet& laid, const Surface& surface, const RidgeOptions& options, const PlyMaterial& ply) {
        const py::gil_scoped_release release;
        return post_process(minimum.nodes, laid.net.neighbours, laid.net.inside, surface, options,
                            bridge_hold(laid, minimum.tensions_n, ply.friction, ply.pressure_mpa));
      },
      py::arg("minimum"), py::arg("net"), py::arg("surface"), py::arg("options"), py::arg("ply"));
  m.def("largest_fibre_excess", &largest_excess_of_arrays, py::arg("nodes_mm"), py::arg("neighbours"), py::arg("surface"));
}

}  // namespace debulk
