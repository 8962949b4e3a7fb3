#include <array>
#include <optional>

#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "bindings/cloud_view.hpp"
#include "bindings/convert.hpp"
#include "bindings/seen.hpp"
#include "debulk/rawscan/quiet_squares.hpp"
#include "debulk/rawscan/riders.hpp"
#include "debulk/rawscan/standing_wrinkles.hpp"

namespace debulk {
namespace {

SquareLattice lattice_of(const CloudArray& scan, int step) {
  require(scan.ndim() == 3, "scan", "an (H, W, 3) image of points", shape_of(scan));
  require(step >= 1, "step", "a positive number of pixels", step);
  return {cloud_view(scan, "scan"), step};
}

// Binds a search of the raw scan. Its result is `listed` applied to the findings, and whether the search gave up.
template <class Found, class Options, class Listed>
void def_search(py::class_<WrinkleFinder>& finder, const char* name,
                Found (WrinkleFinder::*search)(const CloudView&, const std::uint8_t*, double, const Options&, const Stop&) const,
                const Listed& listed) {
  finder.def(
      name,
      [search, listed](const WrinkleFinder& in, const CloudArray& scan, const std::optional<Array<std::uint8_t>>& mask, double pitch_mm,
                       const Options& options, const Stop& stop) {
        const CloudView cloud = cloud_view(scan, "scan");
        const std::uint8_t* masked = mask_of(mask, cloud);
        Found found;
        {
          const py::gil_scoped_release release;
          found = (in.*search)(cloud, masked, pitch_mm, options, stop);
        }
        return py::make_tuple(listed(found), found.gave_up);
      },
      py::arg("scan"), py::arg("mask").none(true), py::arg("pitch_mm"), py::arg("options"), py::arg("stop"));
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

  py::class_<WrinkleOptions>(m, "WrinkleOptions")
      .def(py::init<>())
      .def_readwrite("widest_mm", &WrinkleOptions::widest_mm)
      .def_readwrite("links", &WrinkleOptions::links)
      .def_readwrite("most", &WrinkleOptions::most);

  py::class_<NarrowBumpOptions>(m, "NarrowBumpOptions").def(py::init<>()).def_readwrite("most", &NarrowBumpOptions::most);

  py::class_<WrinkleFinder> finder(m, "WrinkleFinder");
  finder.def(py::init([](std::shared_ptr<Reference> reference, const SeenArray& seen, const Array<double>& pose,
                         const Array<double>& ply_outline, int threads) {
               const Eigen::Matrix4d motion = pose_of(pose);
               const Polygon outline = points<2>(ply_outline, "ply_outline");
               const std::optional<Grid<float>> fitted_to = seen_grid(seen);
               const py::gil_scoped_release release;
               return std::make_unique<WrinkleFinder>(std::move(reference), *fitted_to, motion, outline, threads);
             }),
             py::arg("reference"), py::arg("seen"), py::arg("mold_from_scanner"), py::arg("ply_outline"), py::arg("threads"));
  // Returns each wrinkle's crest with its height and width, and whether the search gave up.
  def_search(finder, "find", &WrinkleFinder::find, [](const StandingWrinkles& found) {
    py::list wrinkles;
    for (const StandingWrinkle& one : found.wrinkles) wrinkles.append(py::make_tuple(to_array(one.along), one.height, one.width));
    return wrinkles;
  });
  // Returns each bump's x, y, height, width and length, and whether the search gave up.
  def_search(finder, "find_bumps", &WrinkleFinder::find_bumps, [](const NarrowBumps& found) {
    std::vector<std::array<double, 5>> bumps;
    for (const NarrowBump& one : found.bumps) bumps.push_back({one.top.x(), one.top.y(), one.height, one.width, one.length});
    return bumps;
  });
  // Returns each rider's x, y, height and width.
  m.def(
      "riders",
      [](const CloudArray& points, double pitch_mm, const FootMap& feet, const Foot& foot, const Surface& reference, const Stop& stop) {
        const CloudView cloud = cloud_view(points, "points");
        std::vector<std::array<double, 4>> listed;
        const py::gil_scoped_release release;
        for (const Rider& one : riders(cloud, pitch_mm, feet, foot, reference, {}, stop))
          listed.push_back({one.top.x(), one.top.y(), one.height, one.wide});
        return listed;
      },
      py::arg("points"), py::arg("pitch_mm"), py::arg("feet"), py::arg("foot"), py::arg("reference"), py::arg("stop"));
}

}  // namespace debulk
