#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "bindings/cloud_view.hpp"
#include "bindings/convert.hpp"
#include "debulk/rawscan/quiet_squares.hpp"

namespace debulk {
namespace {

SquareLattice lattice_of(const CloudArray& scan, int step) {
  require(scan.ndim() == 3, "scan", "an (H, W, 3) image of points", shape_of(scan));
  require(step >= 1, "step", "a positive number of pixels", step);
  return {cloud_view(scan, "scan"), step};
}

}  // namespace

void bind_rawscan(py::module_ m) {
  m.attr("square_side") = SquareLattice::side;

  py::class_<QuietLimits>(m, "QuietLimits")
      .def_property_readonly("told", &QuietLimits::told)
      .def_readonly("stepped", &QuietLimits::stepped)
      .def_property_readonly("step_mm", [](const QuietLimits& limits) { return limits.rounding.step; })
      .def_readonly("scatter_mm", &QuietLimits::scatter);

  // Limits along each of the (A, 3) axes.
  m.def(
      "quiet_limits",
      [](const CloudArray& scan, int step, const Array<int>& squares, const Array<float>& axes, int threads, const Stop& stop) {
        const SquareLattice lattice = lattice_of(scan, step);
        require(axes.ndim() == 2 && axes.shape(1) == 3, "axes", "an (A, 3) array", shape_of(axes));
        const std::vector<int> numbers(squares.data(), squares.data() + squares.size());
        std::vector<Eigen::Vector3f> along;
        for (py::ssize_t k = 0; k < axes.shape(0); ++k) along.emplace_back(axes.at(k, 0), axes.at(k, 1), axes.at(k, 2));
        const py::gil_scoped_release release;
        return quiet_limits(lattice, numbers, along, threads, stop);
      },
      py::arg("scan"), py::arg("step"), py::arg("squares"), py::arg("axes"), py::arg("threads"), py::arg("stop"));

  m.def(
      "quiet_squares",
      [](const CloudArray& scan, int step, const std::vector<QuietLimits>& limits, int threads, const Stop& stop) {
        const SquareLattice lattice = lattice_of(scan, step);
        std::vector<std::uint8_t> quiet;
        {
          const py::gil_scoped_release release;
          quiet = quiet_squares(lattice, limits, threads, stop);
        }
        return to_array(std::move(quiet), {lattice.rows(), lattice.columns()});
      },
      py::arg("scan"), py::arg("step"), py::arg("limits"), py::arg("threads"), py::arg("stop"));
}

}  // namespace debulk
