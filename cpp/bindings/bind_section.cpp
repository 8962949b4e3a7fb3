#include <pybind11/stl.h>

#include <optional>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/section/fold.hpp"

namespace debulk {
namespace {

SectionFold fold_of_arrays(double excess, double span, double stiffness, double pressure_mpa, const std::optional<Array<double>>& profile,
                           int segments, int steps, const std::string& pressure, const std::string& bending, bool self_contact,
                           double contact_distance, const Stop& stop) {
  std::vector<Eigen::Vector2d> mold;
  if (profile) {
    mold = points<2>(*profile, "profile");
    require(mold.size() >= 2, "profile", "two or more points", mold.size());
  }
  SectionOptions options;
  options.segments = segments;
  options.steps = steps;
  options.pressure = pressure;
  options.bending = bending;
  options.self_contact = self_contact;
  options.contact_distance = contact_distance;
  options.solve.stop = stop;
  const py::gil_scoped_release release;
  return fold_section(excess, span, SectionPly{stiffness, pressure_mpa}, mold, options);
}

}  // namespace

void bind_section(py::module_& m) {
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

  m.def("fold_section", &fold_of_arrays, py::arg("excess_length_mm"), py::arg("span_mm"), py::kw_only(), py::arg("stiffness_n_mm"),
        py::arg("pressure_mpa"), py::arg("profile"), py::arg("segments"), py::arg("steps"), py::arg("pressure"), py::arg("bending"),
        py::arg("self_contact"), py::arg("contact_distance_mm"), py::arg("stop"));
}

}  // namespace debulk
