#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "debulk/solve/certificate.hpp"
#include "debulk/solve/method.hpp"
#include "debulk/solve/options.hpp"

namespace py = pybind11;

namespace debulk {

void bind_solve(py::module_ m) {
  m.def("method_names", &method_names);
  py::class_<SolveOptions>(m, "SolveOptions")
      .def(py::init<>())
      .def_readwrite("tolerance", &SolveOptions::tolerance)
      .def_readwrite("max_iterations", &SolveOptions::max_iterations)
      .def_readwrite("stiffness", &SolveOptions::stiffness);
  py::class_<Certificate>(m, "Certificate")
      .def_readonly("kkt_error", &Certificate::kkt_error)
      .def_readonly("strict_kkt_error", &Certificate::strict_kkt_error)
      .def_readonly("length_error", &Certificate::length_error)
      .def_readonly("penetration_mm", &Certificate::penetration_mm)
      .def_readonly("energy_gain_mj", &Certificate::energy_gain_mj)
      .def_readonly("curvature", &Certificate::curvature)
      .def_readonly("compliant", &Certificate::compliant)
      .def_property_readonly("certified", &Certificate::certified)
      .def_property_readonly("failure", &Certificate::failure);
}

}  // namespace debulk
