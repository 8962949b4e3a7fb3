#include <pybind11/stl.h>

#include <optional>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/section/fold.hpp"

namespace debulk {
namespace {

SectionFold fold_of_arrays(double excess, double span, const SectionPly& ply, const std::optional<Array<double>>& profile,
                           SectionOptions options, const Stop& stop) {
  std::vector<Eigen::Vector2d> mold;
  if (profile) {
    mold = points<2>(*profile, "profile");
    require(mold.size() >= 2, "profile", "two or more points", mold.size());
  }
  options.solve.stop = stop;
  const py::gil_scoped_release release;
  return fold_section(excess, span, ply, mold, options);
}

}  // namespace

void bind_section(py::module_ m) {
  py::class_<SectionStep>(m, "SectionStep")
      .def_readonly("pressure_mpa", &SectionStep::pressure)
      .def_readonly("height_mm", &SectionStep::height)
      .def_readonly("foot_width_mm", &SectionStep::foot_width)
      .def_readonly("end_force_n_per_mm", &SectionStep::end_force)
      .def_readonly("iterations", &SectionStep::iterations);

  py::class_<SectionFold>(m, "SectionFold")
      .def_property_readonly("points_mm", [](const SectionFold& f) { return to_array<2>(f.points); })
      .def_readonly("steps", &SectionFold::steps)
      .def_property_readonly("status", [](const SectionFold& f) { return name(f.status); })
      .def_property_readonly("explanation", &SectionFold::explanation)
      .def_readonly("certificate", &SectionFold::certificate)
      .def_property_readonly("certified", &SectionFold::certified)
      .def_readonly("guide_force_n_per_mm", &SectionFold::guide_force)
      .def_readonly("natural_length_mm", &SectionFold::natural_length);

  py::class_<SectionPly>(m, "SectionPly")
      .def(py::init<>())
      .def_readwrite("stiffness_n_mm", &SectionPly::stiffness)
      .def_readwrite("pressure_mpa", &SectionPly::pressure);

  py::class_<SectionOptions>(m, "SectionOptions")
      .def(py::init<>())
      .def_readwrite("segments", &SectionOptions::segments)
      .def_readwrite("steps", &SectionOptions::steps)
      .def_readwrite("pressure", &SectionOptions::pressure)
      .def_readwrite("bending", &SectionOptions::bending)
      .def_readwrite("self_contact", &SectionOptions::self_contact)
      .def_readwrite("contact_distance_mm", &SectionOptions::contact_distance);

  m.def("fold_section", &fold_of_arrays, py::arg("excess_length_mm"), py::arg("span_mm"), py::arg("ply"), py::arg("profile").none(true),
        py::arg("options"), py::arg("stop"));
}

}  // namespace debulk
