#include <array>
#include <limits>
#include <optional>
#include <sstream>
#include <tuple>

#include "bindings/bind.hpp"
#include "bindings/cloud_view.hpp"
#include "bindings/convert.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/surface/cliffs.hpp"
#include "debulk/surface/datum.hpp"
#include "debulk/surface/fit_reference.hpp"
#include "debulk/surface/front_end.hpp"
#include "debulk/surface/height_map.hpp"
#include "debulk/surface/median.hpp"
#include "debulk/surface/misfit.hpp"
#include "debulk/surface/row_medians.hpp"
#include "debulk/surface/thin_plate.hpp"

namespace debulk {
namespace {

// The heights to which a reference was fitted: values, origin, spacing.
using SeenArray = std::tuple<Array<float>, std::array<double, 2>, double>;

Eigen::Vector2d vector2(const std::array<double, 2>& v) {
  return {v[0], v[1]};
}
py::array_t<double> pair(const Eigen::Vector2d& v) {
  return py::array_t<double>(2, v.data());
}

// Samples the surface at (M, 2) points; throws InputError for a point that is not inside.
std::vector<SurfaceSample> samples(const Reference& surface, const Array<double>& xy) {
  const std::vector<Eigen::Vector2d> at = points<2>(xy, "xy");
  py::gil_scoped_release release;
  std::vector<SurfaceSample> out(at.size());
  const Grid<double>& domain = surface.heights();
  parallel_for(static_cast<long>(at.size()), 4096, 0, [&](long begin, long end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
      if (!surface.inside(at[k])) {
        std::ostringstream expected, came;
        expected << "points inside the reference's grid, x " << domain.origin.x() << " to " << domain.position(domain.nx - 1, 0).x()
                 << ", y " << domain.origin.y() << " to " << domain.position(0, domain.ny - 1).y() << " mm";
        came << "(" << at[k].x() << ", " << at[k].y() << ") at index " << k;
        require(false, "xy", expected.str().c_str(), came.str());
      }
      out[k] = surface.sample(at[k]);
    }
  });
  return out;
}

// Returns `count` numbers per sample as an array (M, ...).
template <class Write>
py::array_t<double> collect(const std::vector<SurfaceSample>& all, std::size_t count, std::vector<py::ssize_t> item, const Write& write) {
  std::vector<double> values(all.size() * count);
  for (std::size_t k = 0; k < all.size(); ++k) write(all[k], &values[k * count]);
  item.insert(item.begin(), static_cast<py::ssize_t>(all.size()));
  return to_array(std::move(values), std::move(item));
}

HeightMapOptions options(double spacing, double hole_diameter, double jump_ratio) {
  HeightMapOptions out;
  out.spacing = spacing;
  out.fill.diameter = hole_diameter;
  out.gridding.jump_ratio = jump_ratio;
  return out;
}

// Returns a height map relative to either kind of reference, as (heights, measured, origin, spacing).
template <class Base>
py::tuple map_heights(const CloudArray& scan, const Base& reference, const HeightMapOptions& opts, int threads, const Stop& stop) {
  const CloudView cloud = cloud_view(scan, "scan");
  HeightMap map;
  {
    py::gil_scoped_release release;
    map = height_map(cloud, reference, opts, threads, stop);
  }
  const Eigen::Vector2d origin = map.heights.origin;
  const double spacing = map.heights.spacing;
  return py::make_tuple(grid_values(std::move(map.heights)), grid_values(std::move(map.measured)), pair(origin), spacing);
}

// Returns a read-only view of values in an object; `owner` keeps it alive.
template <class T>
py::array_t<T> view_of(const T* values, int rows, int columns, const py::object& owner) {
  py::array_t<T> out({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(columns)}, values, owner);
  out.attr("flags").attr("writeable") = false;
  return out;
}

// Returns the rectangle of the grid under a measured surface.
py::array_t<double> extent(const Reference& surface) {
  const Grid<double>& g = surface.heights();
  const double x = g.nx - 1, y = g.ny - 1;
  return to_array<2>({g.position(0, 0), g.position(x, 0), g.position(x, y), g.position(0, y)});
}

void bind_front_end(py::module_ m) {
  py::class_<FrontEndOptions>(m, "FrontEndOptions")
      .def(py::init<>())
      .def_readwrite("outliers", &FrontEndOptions::outliers)
      .def_readwrite("spacing_mm", &FrontEndOptions::spacing)
      .def_property(
          "jump_ratio", [](const FrontEndOptions& o) { return o.gridding.jump_ratio; },
          [](FrontEndOptions& o, double ratio) { o.gridding.jump_ratio = ratio; })
      .def_property(
          "hole_diameter_mm", [](const FrontEndOptions& o) { return o.fill.diameter; },
          [](FrontEndOptions& o, double diameter) { o.fill.diameter = diameter; })
      .def_readwrite("spike_mm", &FrontEndOptions::spike)
      .def_readwrite("median_cells", &FrontEndOptions::median);

  py::class_<FrontEnd>(m, "FrontEnd")
      .def(py::init([](std::shared_ptr<Reference> reference, const std::array<int, 2>& shape,
                       const std::optional<std::array<double, 3>>& camera, const Array<double>& pose, const std::array<double, 4>& box,
                       const FrontEndOptions& options, int threads, const std::optional<SeenArray>& seen) {
             View view;
             view.height = shape[0], view.width = shape[1];
             if (camera) view.camera = {(*camera)[0], (*camera)[1], (*camera)[2]};
             view.mold_from_scanner = pose_of(pose);
             std::optional<Grid<float>> fitted_to;
             if (seen) fitted_to = to_grid(std::get<0>(*seen), vector2(std::get<1>(*seen)), std::get<2>(*seen), "seen");
             const py::gil_scoped_release release;
             return std::make_unique<FrontEnd>(std::move(reference), Eigen::Vector2d(box[0], box[1]), Eigen::Vector2d(box[2], box[3]), view,
                                               camera.has_value(), options, threads, fitted_to ? &*fitted_to : nullptr);
           }),
           py::arg("reference"), py::arg("shape"), py::arg("camera").none(true), py::arg("mold_from_scanner"), py::arg("box"),
           py::arg("options"), py::arg("threads"), py::arg("seen").none(true))
      .def(
          "run",
          [](const py::object& self, const CloudArray& scan, const Stop& stop) {
            FrontEnd& front = self.cast<FrontEnd&>();
            const CloudView cloud = cloud_view(scan, "scan");
            const HeightMap* map = nullptr;
            {
              const py::gil_scoped_release release;
              map = &front.run(cloud, stop);
            }
            const Grid<float>& h = map->heights;
            const auto view = [&](const auto& values) -> py::object {
              return values.empty() ? py::object(py::none()) : py::object(view_of(values.data(), h.ny, h.nx, self));
            };
            return py::make_tuple(view(h.values), view(map->measured.values), view(map->before_median.values), pair(h.origin), h.spacing);
          },
          py::arg("scan"), py::arg("stop"))
      .def("keep",
           [](const py::object& self, const std::array<int, 2>& shape) {
             const std::vector<std::uint8_t>& keep = self.cast<const FrontEnd&>().keep();
             require(keep.size() == static_cast<std::size_t>(shape[0]) * static_cast<std::size_t>(shape[1]), "keep",
                     "a scan of the camera's shape before", std::to_string(keep.size()) + " points");
             return view_of(keep.data(), shape[0], shape[1], self);
           })
      .def_property_readonly("fast", &FrontEnd::fast)
      .def_property_readonly("blur_mm2", [](const FrontEnd& f) { return f.blur_mm2(); })
      .def_property_readonly("times", [](const FrontEnd& f) {
        return std::array<double, 5>{f.times().clean, f.times().grid, f.times().fill, f.times().spikes, f.times().median};
      });
}

// A filter of maps, which has one parameter.
template <class Parameter, class Filter>
void define_filter(py::module_ m, const char* name, const char* parameter, Filter filter) {
  const auto filtered = [filter](const Array<float>& values, Parameter value, int threads) {
    const Grid<float> grid = to_grid(values, {0, 0}, 1.0, "grid");
    Grid<float> out;
    {
      const py::gil_scoped_release release;
      filter(grid, value, out, threads);
    }
    return grid_values(std::move(out));
  };
  m.def(name, filtered, py::arg("values"), py::arg(parameter), py::arg("threads"));
}

}  // namespace

void bind_surface(py::module_ m) {
  py::class_<Surface, std::shared_ptr<Surface>>(m, "Surface");
  py::class_<Reference, Surface, std::shared_ptr<Reference>>(m, "Reference")
      .def(py::init([](const Array<double>& heights, const std::array<double, 2>& origin, double spacing) {
             return Reference(to_grid(heights, vector2(origin), spacing, "heights_mm"));
           }),
           py::arg("heights_mm"), py::arg("origin_mm"), py::arg("spacing_mm"))
      .def_property_readonly("heights_mm", [](const Reference& r) { return grid_values(Grid<double>(r.heights())); })
      .def_property_readonly("origin_mm", [](const Reference& r) { return pair(r.heights().origin); })
      .def_property_readonly("spacing_mm", [](const Reference& r) { return r.heights().spacing; })
      .def(
          "_height",
          [](const Reference& r, const Array<double>& xy) {
            return collect(samples(r, xy), 1, {}, [](const SurfaceSample& s, double* to) { *to = s.height; });
          },
          py::arg("xy"))
      .def(
          "_gradient",
          [](const Reference& r, const Array<double>& xy) {
            return collect(samples(r, xy), 2, {2}, [](const SurfaceSample& s, double* to) {
              Eigen::Map<Eigen::Vector2d> out(to, 2);
              out = s.gradient;
            });
          },
          py::arg("xy"))
      .def(
          "_hessian",
          [](const Reference& r, const Array<double>& xy) {
            return collect(samples(r, xy), 4, {2, 2}, [](const SurfaceSample& s, double* to) {
              Eigen::Map<Eigen::Matrix2d> out(to, 2, 2);
              out = s.hessian;
            });
          },
          py::arg("xy"));

  m.def(
      "grid_heights",
      [](const CloudArray& cloud, const std::array<double, 2>& origin, double spacing, const std::array<int, 2>& shape, double jump_ratio,
         double pitch, int threads, const Stop& stop) {
        require(shape[0] > 0 && shape[1] > 0, "shape", "positive numbers of rows and columns",
                std::to_string(shape[0]) + " by " + std::to_string(shape[1]));
        const CloudView view = cloud_view(cloud, "points");
        Grid<float> grid(shape[1], shape[0], vector2(origin), spacing);
        {
          py::gil_scoped_release release;
          grid_heights(view, grid, {jump_ratio, pitch}, threads, stop);
        }
        return grid_values(std::move(grid));
      },
      py::arg("points"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("shape"), py::arg("jump_ratio"), py::arg("pitch_mm"),
      py::arg("threads"), py::arg("stop"));

  m.def(
      "covering_grid",
      [](const std::array<double, 2>& low, const std::array<double, 2>& high, double spacing) {
        const Grid<float> grid = covering_grid(vector2(low), vector2(high), spacing);
        return py::make_tuple(pair(grid.origin), std::array<int, 2>{grid.ny, grid.nx});
      },
      py::arg("low_mm"), py::arg("high_mm"), py::arg("spacing_mm"));

  m.def(
      "height_map",
      [](const CloudArray& scan, const Reference& reference, double spacing, double hole_diameter, double jump_ratio, int threads,
         const Stop& stop) { return map_heights(scan, reference, options(spacing, hole_diameter, jump_ratio), threads, stop); },
      py::arg("scan"), py::arg("reference"), py::arg("spacing_mm"), py::arg("hole_diameter_mm"), py::arg("jump_ratio"), py::arg("threads"),
      py::arg("stop"));
  m.def(
      "height_map",
      [](const CloudArray& scan, const CloudArray& reference, double spacing, double hole_diameter, double jump_ratio, int threads,
         const Stop& stop) {
        return map_heights(scan, cloud_view(reference, "reference"), options(spacing, hole_diameter, jump_ratio), threads, stop);
      },
      py::arg("scan"), py::arg("reference"), py::arg("spacing_mm"), py::arg("hole_diameter_mm"), py::arg("jump_ratio"), py::arg("threads"),
      py::arg("stop"));

  const auto rows = [](const auto& grid, int cells, auto& out, int threads) { out = row_medians(grid, cells, threads); };
  define_filter<int>(m, "median", "size", [](const auto& grid, int size, auto& out, int threads) { median(grid, size, out, threads); });
  define_filter<int>(m, "row_medians", "cells", rows);
  define_filter<double>(m, "without_spikes", "tolerance_mm",
                        [](const auto& grid, double mm, auto& out, int threads) { without_spikes(grid, mm, out, threads); });

  py::class_<FitOptions>(m, "FitOptions")
      .def(py::init<>())
      .def_readwrite("node_spacing_mm", &FitOptions::spacing)
      .def_readwrite("window_mm", &FitOptions::window)
      .def_readwrite("robust", &FitOptions::robust)
      .def_readwrite("doublings", &FitOptions::doublings);

  m.def(
      "fit_reference",
      [](const Array<float>& values, const std::array<double, 2>& origin, double spacing, const FitOptions& options,
         const Array<std::uint8_t>& under_ply, int threads, const Stop& stop) {
        const Grid<float> heights = to_grid(values, vector2(origin), spacing, "heights");
        const auto marks = to_grid(under_ply, vector2(origin), spacing, "under_ply");
        std::optional<Reference> fit;
        {
          py::gil_scoped_release release;
          fit = fit_reference(heights, options, threads, stop, marks);
        }
        return py::make_tuple(grid_values(Grid<double>(fit->heights())), pair(fit->heights().origin), fit->heights().spacing);
      },
      py::arg("values"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("options"), py::arg("under_ply"), py::arg("threads"),
      py::arg("stop"));

  m.def(
      "datum",
      [](const Reference& mold, double thickness, int threads) {
        Grid<double> nodes;
        {
          py::gil_scoped_release release;
          nodes = datum(mold, thickness, threads).heights();
        }
        return grid_values(std::move(nodes));
      },
      py::arg("reference"), py::arg("thickness_mm"), py::arg("threads"));

  m.def(
      "misfits",
      [](const Array<float>& values, const std::array<double, 2>& origin, double spacing, const Reference& fit, int threads,
         const Stop& stop) {
        const Grid<float> heights = to_grid(values, vector2(origin), spacing, "heights");
        Grid<std::uint8_t> out;
        {
          py::gil_scoped_release release;
          out = misfits(heights, fit, threads, stop);
        }
        return grid_values(std::move(out));
      },
      py::arg("values"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("reference"), py::arg("threads"), py::arg("stop"));

  m.def(
      "above_cliffs",
      [](const Array<float>& values, const std::array<double, 2>& origin, double spacing, int threads, const Stop& stop) {
        const Grid<float> heights = to_grid(values, vector2(origin), spacing, "heights");
        Grid<std::uint8_t> out;
        {
          py::gil_scoped_release release;
          out = above_cliffs(heights, threads, stop);
        }
        return grid_values(std::move(out));
      },
      py::arg("values"), py::arg("origin_mm"), py::arg("spacing_mm"), py::arg("threads"), py::arg("stop"));

  // Returns the heights with the marked ones replaced by those of a bent plate; None if the others do not determine it.
  m.def(
      "bridged",
      [](const Array<float>& values, const Array<std::uint8_t>& unknown, double levelling, const Stop& stop) -> py::object {
        Grid<float> heights = to_grid(values, {0, 0}, 1.0, "heights");
        const Grid<std::uint8_t> marked = to_grid(unknown, {0, 0}, 1.0, "unknown");
        require(marked.nx == heights.nx && marked.ny == heights.ny, "unknown", "a mask of the heights' shape", shape_of(unknown));
        std::vector<std::size_t> points;
        for (std::size_t k = 0; k < marked.size(); ++k)
          if (marked.values[k]) points.push_back(k), heights.values[k] = std::numeric_limits<float>::quiet_NaN();
        std::vector<double> plate;
        {
          py::gil_scoped_release release;
          plate = thin_plate(heights, points, levelling, stop);
        }
        if (plate.size() != points.size()) return py::none();
        for (std::size_t n = 0; n < points.size(); ++n) heights.values[points[n]] = static_cast<float>(plate[n]);
        return grid_values(std::move(heights));
      },
      py::arg("heights"), py::arg("unknown"), py::arg("levelling"), py::arg("stop"));
  m.def("extent", &extent, py::arg("surface"));
  bind_front_end(m);
}

}  // namespace debulk
