#include <pybind11/pybind11.h>

#include "bindings/bind.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/stop.hpp"

namespace py = pybind11;

namespace {

constexpr const char* kElsewhere =
    "debulk: cannot be imported in a subinterpreter; import it in the process's main interpreter, or in another process";

bool in_main_interpreter() {
  return PyInterpreterState_Get() == PyInterpreterState_Main();
}

}  // namespace

// pybind11 makes PyInit_core of this, which PyInit__core below calls. The module's name is that of its import.
PYBIND11_MODULE(core, m, py::multiple_interpreters::not_supported()) {
  // Python 3.13 and later run PyInit in the main interpreter, and only this in the subinterpreter.
  if (!in_main_interpreter()) throw py::import_error(kElsewhere);
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
  debulk::bind_fibre(room("fibre"));
  debulk::bind_net(room("net"));
  debulk::bind_solve(room("solve"));
  debulk::bind_sheet(room("sheet"));
  debulk::bind_ridge(room("ridge"));
  debulk::bind_section(room("section"));
  debulk::bind_verdict(room("verdict"));
}

// Before Python 3.12 pybind11 waits for ever when it is initialised in a subinterpreter, so the check comes first.
extern "C" PYBIND11_EXPORT PyObject* PyInit__core() {
#ifdef Py_GIL_DISABLED
  PyErr_SetString(PyExc_ImportError, "debulk: was not tried on a free-threaded Python; use the ordinary one of the same version");
  return nullptr;
#endif
  if (in_main_interpreter()) return PyInit_core();
  PyErr_SetString(PyExc_ImportError, kElsewhere);
  return nullptr;
}
