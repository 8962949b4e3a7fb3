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
  const auto room = [&m](const char* name) { return m.def_submodule(name); };
  debulk::bind_scanner(room("scanner"));
  debulk::bind_cloud(room("cloud"));
  debulk::bind_files(room("files"));
  debulk::bind_surface(room("surface"));
  debulk::bind_pocket(room("pocket"));
  debulk::bind_region(room("region"));
  debulk::bind_net(room("net"));
  debulk::bind_solve(room("solve"));
  debulk::bind_sheet(room("sheet"));
  debulk::bind_ridge(room("ridge"));
  debulk::bind_section(room("section"));
  debulk::bind_verdict(room("verdict"));
}
