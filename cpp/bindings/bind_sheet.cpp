#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/sheet/certify.hpp"
#include "debulk/sheet/minimise.hpp"

namespace debulk {
namespace {

Net net_of(const Array<double>& nodes, const Array<int>& neighbours, const Array<int>& kinds, double spacing) {
  Net net;
  net.nodes = points<3>(nodes, "nodes_mm");
  const auto count = static_cast<py::ssize_t>(net.nodes.size());
  require(neighbours.ndim() == 2 && neighbours.shape(0) == count && neighbours.shape(1) == 4, "neighbours",
          ("an array of shape (" + std::to_string(count) + ", 4)").c_str(), shape_of(neighbours));
  require(kinds.ndim() == 1 && kinds.shape(0) == count, "kinds", ("an array of shape (" + std::to_string(count) + ",)").c_str(),
          shape_of(kinds));
  net.neighbours.resize(net.nodes.size());
  std::memcpy(net.neighbours.data(), neighbours.data(), net.nodes.size() * sizeof(Neighbours));
  for (py::ssize_t i = 0; i < count; ++i) {
    require(kinds.at(i) >= 0 && kinds.at(i) <= 2, "kinds", "0 (inner), 1 (fixed) or 2 (free)", kinds.at(i));
    net.kinds.push_back(static_cast<NodeKind>(kinds.at(i)));
  }
  net.spacing = spacing;
  return net;
}

py::tuple lower_triangle(const Sheet& sheet, const Array<double>& x) {
  const Eigen::SparseMatrix<double> lower = sheet.hessian(points<3>(x, "x")).lower();
  std::vector<int> rows, columns;
  std::vector<double> values;
  for (int c = 0; c < lower.outerSize(); ++c)
    for (Eigen::SparseMatrix<double>::InnerIterator it(lower, c); it; ++it) {
      rows.push_back(static_cast<int>(it.row()));
      columns.push_back(c);
      values.push_back(it.value());
    }
  const auto count = static_cast<py::ssize_t>(values.size());
  return py::make_tuple(to_array(std::move(rows), {count}), to_array(std::move(columns), {count}), to_array(std::move(values), {count}));
}

MinimiseOptions options_of(const std::string& method, int starts, std::uint64_t seed, double tolerance, int max_iterations,
                           double stiffness, const Stop& stop) {
  MinimiseOptions options;
  options.method = method;
  options.starts = starts;
  options.seed = seed;
  options.solve.tolerance = tolerance;
  options.solve.max_iterations = max_iterations;
  options.solve.stiffness = stiffness;
  options.solve.stop = stop;
  return options;
}

}  // namespace

void bind_sheet(py::module_& m) {
  py::class_<PlyMaterial>(m, "Ply").def(
      py::init([](double thickness, double young, double shear, double density, double friction, double pressure, double gravity) {
        PlyMaterial ply{thickness, young, shear, density, friction, pressure, gravity};
        ply.check();
        return ply;
      }),
      py::kw_only(), py::arg("thickness_mm"), py::arg("young_mpa"), py::arg("shear_mpa"), py::arg("density_kg_m3"), py::arg("friction"),
      py::arg("pressure_mpa"), py::arg("gravity_m_s2"));

  py::class_<Sheet, std::shared_ptr<Sheet>>(m, "Sheet")
      .def(py::init([](const Array<double>& nodes, const Array<int>& neighbours, const Array<int>& kinds, double spacing, double area,
                       std::shared_ptr<Surface> reference, const PlyMaterial& ply) {
             return std::make_shared<Sheet>(net_of(nodes, neighbours, kinds, spacing), area, ply, std::move(reference));
           }),
           py::arg("nodes_mm"), py::arg("neighbours"), py::arg("kinds"), py::arg("spacing_mm"), py::arg("area_mm2"), py::arg("reference"),
           py::arg("ply"))
      .def(
          "energy", [](const Sheet& s, const Array<double>& x) { return s.energy(points<3>(x, "x")); }, py::arg("x"))
      .def(
          "terms",
          [](const Sheet& s, const Array<double>& x) {
            py::dict out;
            for (const auto& [name, value] : s.terms(points<3>(x, "x"))) out[py::str(name)] = value;
            return out;
          },
          py::arg("x"))
      .def(
          "gradient", [](const Sheet& s, const Array<double>& x) { return to_array<3>(s.gradient(points<3>(x, "x"))); }, py::arg("x"))
      .def("hessian", &lower_triangle, py::arg("x"))
      .def(
          "lengths",
          [](const Sheet& s, const Array<double>& x) {
            std::vector<double> out = s.lengths(points<3>(x, "x"));
            const auto count = static_cast<py::ssize_t>(out.size());
            return to_array(std::move(out), {count});
          },
          py::arg("x"))
      .def(
          "gaps",
          [](const Sheet& s, const Array<double>& x) {
            std::vector<double> out = s.gaps(points<3>(x, "x"));
            const auto count = static_cast<py::ssize_t>(out.size());
            return to_array(std::move(out), {count});
          },
          py::arg("x"))
      .def_property_readonly("start", [](const Sheet& s) { return to_array<3>(s.start()); })
      .def_property_readonly("movable_count", [](const Sheet& s) { return s.movable().size(); })
      .def_property_readonly("nodal_force_n", &Sheet::nodal_force_n)
      .def_property_readonly("force_unit_n", &Sheet::force_unit_n)
      .def_property_readonly("left_out", &Sheet::left_out);

  m.def(
      "minimise",
      [](const std::shared_ptr<Sheet>& sheet, const std::string& method, const py::object& start, int starts, int first_start,
         std::uint64_t seed, double tolerance, int max_iterations, double stiffness, const Stop& stop) {
        MinimiseOptions options = options_of(method, starts, seed, tolerance, max_iterations, stiffness, stop);
        options.first_start = first_start;
        Points from;
        if (!start.is_none()) from = points<3>(start.cast<Array<double>>(), "start");
        const py::gil_scoped_release release;
        return minimise(*sheet, options, start.is_none() ? nullptr : &from);
      },
      py::arg("sheet"), py::kw_only(), py::arg("method"), py::arg("start"), py::arg("starts"), py::arg("first_start"), py::arg("seed"),
      py::arg("tolerance"), py::arg("max_iterations"), py::arg("stiffness"), py::arg("stop"));
  m.def(
      "minimise_all",
      [](const std::vector<std::shared_ptr<Sheet>>& sheets, const std::string& method, int starts, std::uint64_t seed, double tolerance,
         int max_iterations, double stiffness, const Stop& stop, int threads) {
        const MinimiseOptions options = options_of(method, starts, seed, tolerance, max_iterations, stiffness, stop);
        std::vector<const Sheet*> all;
        for (const auto& sheet : sheets) all.push_back(sheet.get());
        const py::gil_scoped_release release;
        return minimise_all(all, options, threads);
      },
      py::arg("sheets"), py::kw_only(), py::arg("method"), py::arg("starts"), py::arg("seed"), py::arg("tolerance"),
      py::arg("max_iterations"), py::arg("stiffness"), py::arg("stop"), py::arg("threads"));
  m.def("certify", [](const Sheet& sheet, const Array<double>& x, double stiffness) {
    return certify(sheet, points<3>(x, "nodes_mm"), stiffness).certificate;
  });

  py::class_<Minimum>(m, "Minimum")
      .def_property_readonly("nodes_mm", [](const Minimum& s) { return to_array<3>(s.nodes); })
      .def_property_readonly("status", [](const Minimum& s) { return name(s.status); })
      .def_property_readonly("explanation", [](const Minimum& s) { return explanation(s.status); })
      .def_readonly("certificate", &Minimum::certificate)
      .def_property_readonly("certified", &Minimum::certified)
      .def_readonly("energy_mj", &Minimum::energy_mj)
      .def_readonly("iterations", &Minimum::iterations)
      .def_readonly("evaluations", &Minimum::evaluations);
}

}  // namespace debulk
