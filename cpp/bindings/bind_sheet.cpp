#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <optional>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/net/fibre_net.hpp"
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

void bind_minimiser(py::module_ m) {
  py::class_<MinimiseOptions>(m, "MinimiseOptions")
      .def(py::init<>())
      .def_readwrite("method", &MinimiseOptions::method)
      .def_readwrite("starts", &MinimiseOptions::starts)
      .def_readwrite("first_start", &MinimiseOptions::first_start)
      .def_readwrite("seed", &MinimiseOptions::seed)
      .def_readwrite("solve", &MinimiseOptions::solve);

  py::class_<Minimum, std::shared_ptr<Minimum>>(m, "Minimum")
      .def_property_readonly("nodes_mm", [](const Minimum& s) { return to_array<3>(s.nodes); })
      .def_property_readonly("status", [](const Minimum& s) { return name(s.status); })
      .def_property_readonly("explanation", [](const Minimum& s) { return explanation(s.status); })
      .def_readonly("certificate", &Minimum::certificate)
      .def_property_readonly("certified", &Minimum::certified)
      .def_property_readonly("tensions_n",
                             [](const Minimum& s) {
                               std::vector<double> tensions = s.tensions_n;
                               const auto count = static_cast<py::ssize_t>(tensions.size());
                               return to_array(std::move(tensions), {count});
                             })
      .def_readonly("energy_mj", &Minimum::energy_mj)
      .def_readonly("iterations", &Minimum::iterations)
      .def_readonly("evaluations", &Minimum::evaluations);

  py::class_<Minimiser>(m, "Minimiser")
      .def(py::init([](std::shared_ptr<Sheet> sheet) {
             // The GIL is released only here: with a call_guard, pybind11 would register the instance without it.
             const py::gil_scoped_release release;
             return std::make_unique<Minimiser>(std::move(sheet));
           }),
           py::arg("sheet"))
      .def(
          "run",
          [](const Minimiser& minimiser, MinimiseOptions options, const std::optional<Array<double>>& start, const Stop& stop) {
            options.solve.stop = stop;
            Points from;
            if (start) from = points<3>(*start, "start");
            const py::gil_scoped_release release;
            return minimiser.run(options, start ? &from : nullptr);
          },
          py::arg("options"), py::arg("start").none(true), py::arg("stop"));

  m.def("certify", [](const Sheet& sheet, const Array<double>& x, double stiffness) {
    return certify(sheet, points<3>(x, "nodes_mm"), stiffness).certificate;
  });
}

}  // namespace

void bind_sheet(py::module_ m) {
  py::class_<PlyMaterial>(m, "PlyMaterial")
      .def(py::init<>())
      .def_readwrite("thickness_mm", &PlyMaterial::thickness_mm)
      .def_readwrite("young_mpa", &PlyMaterial::young_mpa)
      .def_readwrite("shear_mpa", &PlyMaterial::shear_mpa)
      .def_readwrite("density_kg_m3", &PlyMaterial::density_kg_m3)
      .def_readwrite("friction", &PlyMaterial::friction)
      .def_readwrite("pressure_mpa", &PlyMaterial::pressure_mpa)
      .def_readwrite("gravity_m_s2", &PlyMaterial::gravity_m_s2)
      .def_readwrite("torsion_n_mm", &PlyMaterial::torsion_n_mm)
      .def_readwrite("in_plane_bending_n_mm", &PlyMaterial::in_plane_bending_n_mm)
      .def_readwrite("tack_n_mm3", &PlyMaterial::tack_n_mm3)
      .def_property(
          "pressure_direction",
          [](const PlyMaterial& p) { return p.pressure_direction == PressureDirection::normal ? "normal" : "vertical"; },
          [](PlyMaterial& p, const std::string& name) {
            require(name == "vertical" || name == "normal", "pressure_direction", "\"vertical\" or \"normal\"", "\"" + name + "\"");
            p.pressure_direction = name == "normal" ? PressureDirection::normal : PressureDirection::vertical;
          })
      .def_property(
          "lumping", [](const PlyMaterial& p) { return p.lumping == Lumping::paper ? "paper" : "consistent"; },
          [](PlyMaterial& p, const std::string& name) {
            require(name == "consistent" || name == "paper", "lumping", "\"consistent\" or \"paper\"", "\"" + name + "\"");
            p.lumping = name == "paper" ? Lumping::paper : Lumping::consistent;
          });

  py::class_<Sheet, std::shared_ptr<Sheet>>(m, "Sheet")
      .def(py::init([](const Array<double>& nodes, const Array<int>& neighbours, const Array<int>& kinds, double spacing, double area,
                       std::shared_ptr<Surface> reference, const PlyMaterial& ply, const std::vector<double>& to_edge) {
             Net net = net_of(nodes, neighbours, kinds, spacing);
             net.to_edge = to_edge;
             return std::make_shared<Sheet>(std::move(net), area, ply, std::move(reference));
           }),
           py::arg("nodes_mm"), py::arg("neighbours"), py::arg("kinds"), py::arg("spacing_mm"), py::arg("area_mm2"), py::arg("reference"),
           py::arg("ply"), py::arg("edge_mm"))
      .def(py::init([](const PocketNet& laid, std::shared_ptr<Surface> reference, const PlyMaterial& ply) {
             return std::make_shared<Sheet>(laid.net, laid.area, ply, std::move(reference));
           }),
           py::arg("net"), py::arg("reference"), py::arg("ply"))
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
      .def_property_readonly("nodal_force_n", &Sheet::nodal_force_n)
      .def_property_readonly("edge_mm",
                             [](const Sheet& s) {
                               std::vector<double> ways = s.net().to_edge;
                               const auto count = static_cast<py::ssize_t>(ways.size());
                               return to_array(std::move(ways), {count});
                             })
      .def_property_readonly("left_out", &Sheet::left_out);

  bind_minimiser(m);
}

}  // namespace debulk
