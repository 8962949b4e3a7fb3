#include <array>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings/bind.hpp"
#include "bindings/cloud_view.hpp"
#include "bindings/convert.hpp"
#include "debulk/cloud/fourth_differences.hpp"
#include "debulk/cloud/made_points.hpp"
#include "debulk/cloud/outliers.hpp"
#include "debulk/cloud/pinhole.hpp"
#include "debulk/cloud/pinhole_outliers.hpp"
#include "debulk/cloud/pitch.hpp"
#include "debulk/cloud/points_over.hpp"
#include "debulk/cloud/transform.hpp"

namespace debulk {
namespace {

// A part of an image is not copied either.
PointImage point_image(const py::array_t<float>& a, const char* name) {
  const bool fits = a.ndim() == 3 && a.shape(2) == 3 && (a.size() == 0 || (a.strides(1) == 3 * 4 && a.strides(2) == 4));
  require(fits, name, "an (H, W, 3) array of points, or rows and columns of one", shape_of(a));
  return {a.data(), a.strides(0) / 4, static_cast<int>(a.shape(1)), static_cast<int>(a.shape(0))};
}

// (ny, nx) marks with their origin and spacing. They are not copied.
using Marks = std::tuple<py::array_t<bool, py::array::c_style>, std::array<double, 2>, double>;

CellMarks cell_marks(const Marks& given) {
  const auto& [values, origin, spacing] = given;
  require(values.ndim() == 2, "marks", "an (ny, nx) array of bools", shape_of(values));
  const auto* first = reinterpret_cast<const std::uint8_t*>(values.data());  // numpy's bools are bytes, 0 or 1
  return {first, static_cast<int>(values.shape(1)), static_cast<int>(values.shape(0)), {origin[0], origin[1]}, spacing};
}

MadeLimits made_limits(const py::object& given) {
  const auto limit = [&given](const char* name) { return given.attr(name).cast<double>(); };
  return {limit("quiet"),
          limit("wild"),
          limit("least_mm"),
          limit("made"),
          limit("rarest"),
          limit("least_share"),
          given.attr("window_cells").cast<int>()};
}

}  // namespace

void bind_cloud(py::module_ m) {
  m.def(
      "bounds",
      [](const CloudArray& points, int threads) {
        const CloudView cloud = cloud_view(points, "points");
        CloudBounds box;
        {
          py::gil_scoped_release release;
          box = bounds(cloud, threads);
        }
        return py::make_tuple(box.seen, std::vector<double>(box.low.data(), box.low.data() + 3),
                              std::vector<double>(box.high.data(), box.high.data() + 3));
      },
      py::arg("points"), py::arg("threads"));

  m.def(
      "transform",
      [](const CloudArray& points, const Array<double>& matrix, int threads, const Stop& stop) {
        require(matrix.ndim() == 2 && matrix.shape(0) == 4 && matrix.shape(1) == 4, "matrix", "a (4, 4) array", shape_of(matrix));
        const Eigen::Matrix4d motion = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix.data());
        const CloudView cloud = cloud_view(points, "points");
        std::vector<float> moved;
        {
          py::gil_scoped_release release;
          moved = transform(cloud, motion, threads, stop);
        }
        return to_array(std::move(moved), shape(points));
      },
      py::arg("points"), py::arg("matrix"), py::arg("threads"), py::arg("stop"));

  // Returns the moved points, and which of them lie over the box and all marks.
  m.def(
      "points_over",
      [](const CloudArray& points, const std::optional<Array<double>>& matrix, const std::array<std::array<double, 2>, 2>& box,
         const std::vector<Marks>& marks, int threads, const Stop& stop) {
        const CloudView cloud = cloud_view(points, "points");
        const Eigen::Matrix4d motion = matrix ? pose_of(*matrix) : Eigen::Matrix4d::Identity();
        std::vector<CellMarks> cells;
        for (const Marks& one : marks) cells.push_back(cell_marks(one));
        PointsOver out;
        {
          py::gil_scoped_release release;
          out = points_over(cloud, matrix ? &motion : nullptr, {box[0][0], box[0][1]}, {box[1][0], box[1][1]}, cells, threads, stop);
        }
        std::vector<py::ssize_t> marked = shape(points);
        marked.pop_back();
        return py::make_tuple(to_array(std::move(out.moved), shape(points)), to_array(std::move(out.on), marked));
      },
      py::arg("points"), py::arg("matrix"), py::arg("box"), py::arg("marks"), py::arg("threads"), py::arg("stop"));

  py::class_<OutlierOptions>(m, "OutlierOptions")
      .def(py::init<>())
      .def_readwrite("neighbours", &OutlierOptions::neighbours)
      .def_readwrite("std_ratio", &OutlierOptions::std_ratio)
      .def_readwrite("least_ratio", &OutlierOptions::least_ratio);

  m.def(
      "remove_outliers",
      [](const CloudArray& points, const OutlierOptions& options, int threads, const Stop& stop,
         const std::optional<std::array<double, 3>>& camera) {
        const CloudView cloud = cloud_view(points, "points");
        std::vector<std::uint8_t> keep;
        {
          py::gil_scoped_release release;
          PinholeOutliers image;
          if (camera && image.run(cloud, {(*camera)[0], (*camera)[1], (*camera)[2]}, options, nullptr, threads, stop))
            keep = image.keep();
          else
            keep = remove_outliers(cloud, options, threads, stop).keep;
        }
        std::vector<py::ssize_t> mask_shape = shape(points);
        mask_shape.pop_back();
        return to_array(std::move(keep), mask_shape);
      },
      py::arg("points"), py::arg("options"), py::arg("threads"), py::arg("stop"), py::arg("camera") = py::none());

  m.def(
      "move_kept",
      [](const CloudArray& points, py::array_t<float, py::array::c_style>& out, const Array<std::uint8_t>& keep,
         const Array<double>& matrix, int threads, const Stop& stop) {
        const CloudView cloud = cloud_view(points, "points");
        require(shape(out) == shape(points), "out", "the shape of the points", shape_of(out));
        require(static_cast<std::size_t>(keep.size()) == cloud.size(), "keep", "one value per point", shape_of(keep));
        const Eigen::Matrix4d motion = pose_of(matrix);
        float* to = out.mutable_data();
        py::gil_scoped_release release;
        move_kept(cloud.xyz, to, keep.data(), cloud.size(), motion, threads, stop);
      },
      py::arg("points"), py::arg("out").noconvert(), py::arg("keep"), py::arg("matrix"), py::arg("threads"), py::arg("stop"));

  m.def(
      "median_pitch",
      [](const CloudArray& points, int threads, const Stop& stop) {
        const CloudView cloud = cloud_view(points, "points");
        py::gil_scoped_release release;
        return median_pitch(cloud, threads, stop);
      },
      py::arg("points"), py::arg("threads"), py::arg("stop"));

  m.def(
      "widest_pitch",
      [](const CloudArray& points, double pitch, const Stop& stop) {
        const CloudView cloud = cloud_view(points, "points");
        py::gil_scoped_release release;
        return widest_pitch(cloud, pitch, stop);
      },
      py::arg("points"), py::arg("pitch"), py::arg("stop"));

  m.def(
      "fourth_differences",
      [](const py::array_t<float>& heights, const py::array_t<float>& points, int step, const std::vector<std::array<float, 3>>& axes,
         int threads, const Stop& stop) {
        const PointImage of = point_image(heights, "heights"), from = point_image(points, "points");
        require(from.width == of.width && from.height == of.height, "points", "the shape of the heights", shape_of(points));
        require(step >= 1, "step", "1 pixel or more", step);
        PixelDifferences out;
        {
          py::gil_scoped_release release;
          out = fourth_differences(of, from, step, axes, threads, stop);
        }
        const py::ssize_t ways = 2 * static_cast<py::ssize_t>(axes.size());
        return py::make_tuple(to_array(std::move(out.apart), {ways, out.rows, out.columns}),
                              to_array(std::move(out.copied), {out.rows, out.columns}));
      },
      py::arg("heights"), py::arg("points"), py::arg("step"), py::arg("axes"), py::arg("threads"), py::arg("stop"));

  m.def(
      "made_points",
      [](const Array<float>& apart, const Array<bool>& copied, const Array<bool>& on_ply, double step_mm, const py::object& limits,
         int threads, const Stop& stop) -> py::tuple {
        require(apart.ndim() == 3 && apart.shape(0) >= 2 && apart.shape(0) % 2 == 0, "apart", "a (2 A, R, C) array", shape_of(apart));
        const auto fits = [&](const py::array& a) { return a.ndim() == 2 && a.shape(0) == apart.shape(1) && a.shape(1) == apart.shape(2); };
        require(fits(copied), "copied", "one value for each point", shape_of(copied));
        require(fits(on_ply), "on_ply", "one value for each point", shape_of(on_ply));
        const auto bytes = [](const Array<bool>& a) { return reinterpret_cast<const std::uint8_t*>(a.data()); };  // 0 or 1
        const auto size = [&](int axis) { return static_cast<int>(apart.shape(axis)); };
        const AskedPoints asked{size(0), size(1), size(2), apart.data(), bytes(copied), bytes(on_ply)};
        const MadeLimits given = made_limits(limits);
        MadePoints out;
        {
          py::gil_scoped_release release;
          out = made_points(asked, step_mm, given, threads, stop);
        }
        if (!out.noisy) return py::make_tuple(false, false, py::none(), py::none());
        return py::make_tuple(true, out.rounded, to_array(std::move(out.made), {asked.rows, asked.columns}),
                              to_array(std::move(out.marks), {3, asked.rows, asked.columns}));
      },
      py::arg("apart"), py::arg("copied"), py::arg("on_ply"), py::arg("step_mm"), py::arg("limits"), py::arg("threads"), py::arg("stop"));

  m.def("fit_pinhole", [](const CloudArray& points) -> std::optional<std::array<double, 3>> {
    const CloudView cloud = cloud_view(points, "points");
    const py::gil_scoped_release release;
    const std::optional<Pinhole> camera = fit_pinhole(cloud);
    if (!camera) return std::nullopt;
    return std::array<double, 3>{camera->f, camera->cx, camera->cy};
  });
}

}  // namespace debulk
