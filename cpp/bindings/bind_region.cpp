#include <array>
#include <optional>

#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "bindings/cloud_view.hpp"
#include "bindings/convert.hpp"
#include "bindings/seen.hpp"
#include "debulk/pocket/unseen.hpp"
#include "debulk/region/region_front.hpp"

namespace debulk {
void bind_region(py::module_ m) {
  py::class_<RegionOptions>(m, "RegionOptions")
      .def(py::init<>())
      .def_readwrite("front", &RegionOptions::front)
      .def_readwrite("segment", &RegionOptions::segment)
      .def_readwrite("feet", &RegionOptions::feet)
      .def_readwrite("flag_mm", &RegionOptions::flag_mm)
      .def_readwrite("largest_share", &RegionOptions::largest_share)
      .def_readwrite("row_step", &RegionOptions::row_step)
      .def_readwrite("column_step", &RegionOptions::column_step);

  py::class_<RegionFront>(m, "RegionFront")
      .def(py::init([](std::shared_ptr<Reference> reference, const std::array<int, 2>& shape, const std::array<double, 3>& camera,
                       const Array<double>& pose, const RegionOptions& options, int threads, const std::optional<SeenArray>& seen) {
             View view;
             view.height = shape[0], view.width = shape[1];
             view.camera = {camera[0], camera[1], camera[2]};
             view.mold_from_scanner = pose_of(pose);
             const std::optional<Grid<float>> fitted_to = seen_grid(seen);
             const py::gil_scoped_release release;
             const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
             return std::make_unique<RegionFront>(std::move(reference), -far, far, view, options, threads,
                                                  fitted_to ? &*fitted_to : nullptr);
           }),
           py::arg("reference"), py::arg("shape"), py::arg("camera"), py::arg("mold_from_scanner"), py::arg("options"), py::arg("threads"),
           py::arg("seen").none(true))
      .def(
          "run",
          [](RegionFront& front, const CloudArray& scan, const std::optional<Array<std::uint8_t>>& mask, const Stop& stop) {
            const CloudView cloud = cloud_view(scan, "scan");
            const std::uint8_t* masked = mask_of(mask, cloud);
            const py::gil_scoped_release release;
            return front.run(cloud, masked, stop);
          },
          py::arg("scan"), py::arg("mask").none(true), py::arg("stop"))
      // The regions' segmentations and feet. Their memory is reused by the first run that begins when nobody holds them
      // any more.
      .def("regions",
           [](const RegionFront& front) {
             py::list out;
             for (const auto& region : front.regions()) {
               const auto ours = std::const_pointer_cast<Region>(region);  // Python's views are read-only
               out.append(
                   py::make_tuple(std::shared_ptr<Segmentation>(ours, &ours->segmentation), std::shared_ptr<FootMap>(ours, &ours->feet)));
             }
             return out;
           })
      // The overview: heights as (values, origin, spacing), and the areas that were not seen.
      .def(
          "overview",
          [](const RegionFront& front, const UnseenOptions& options) {
            Overview map;
            Unseen unseen;
            {
              const py::gil_scoped_release release;
              map = front.overview();
              unseen = find_unseen(map, options);
            }
            const Eigen::Vector2d origin = map.heights.origin;
            const double spacing = map.heights.spacing;
            return py::make_tuple(grid_values(std::move(map.heights)), py::array_t<double>(2, origin.data()), spacing, unseen);
          },
          py::arg("options"))
      .def_property_readonly("windows",
                             [](const RegionFront& front) {
                               std::vector<std::array<int, 4>> out;
                               for (const auto& r : front.regions())
                                 out.push_back({r->window.i0, r->window.j0, r->window.i1, r->window.j1});
                               return out;
                             })
      .def_property_readonly("usable", &RegionFront::usable)
      .def_property_readonly("reason", &RegionFront::reason)
      .def_property_readonly("image_share", &RegionFront::image_share)
      .def_property_readonly("read_share", &RegionFront::read_share)
      .def_property_readonly("flag_mm", &RegionFront::flag_mm)
      .def_property_readonly("threshold",
                             [](const RegionFront& front) {
                               const SampledThreshold& t = front.threshold();
                               return py::make_tuple(t.value, t.error, t.points);
                             })
      .def_property_readonly("mesh",
                             [](const RegionFront& front) {
                               const Mesh& mesh = front.mesh();
                               return py::make_tuple(mesh.row_step, mesh.column_step, mesh.pixel_mm, mesh.eye_mm2());
                             })
      .def_property_readonly("times", [](const RegionFront& front) {
        const RegionFront::Times& t = front.times();
        return std::array<double, 6>{t.sample, t.coarse, t.windows, t.filter, t.segment, t.feet};
      });
}

}  // namespace debulk
