#include <pybind11/pybind11.h>

#include "bindings/bind.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/stop.hpp"

namespace py = pybind11;

PYBIND11_MODULE(_core, m) {
  m.doc() = "The compiled rooms of debulk. Private: use the typed, documented modules of the package.";
  py::register_exception<debulk::InputError>(m, "InputError", PyExc_ValueError);
  py::register_exception<debulk::Stopped>(m, "Stopped", PyExc_RuntimeError);
  m.def("default_threads", &debulk::default_threads);

  py::class_<debulk::Stop>(m, "Stop")
      .def(py::init<>())
      .def("set_deadline", &debulk::Stop::set_deadline, py::arg("seconds"))
      .def("cancel", &debulk::Stop::cancel)
      .def_property_readonly("cancelled", &debulk::Stop::cancelled)
      .def_property_readonly("past_deadline", &debulk::Stop::past_deadline)
      .def("now", &debulk::Stop::now);

  debulk::bind_build(m);
  debulk::bind_scanner(m);
  debulk::bind_cloud(m);
  debulk::bind_files(m);
  debulk::bind_surface(m);
  debulk::bind_pocket(m);
  debulk::bind_region(m);
  debulk::bind_net(m);
  debulk::bind_solve(m);
  debulk::bind_sheet(m);
  debulk::bind_ridge(m);
  debulk::bind_section(m);
  debulk::bind_verdict(m);
}
