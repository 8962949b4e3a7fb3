#include <pybind11/stl.h>

#include <algorithm>

#include "bindings/bind.hpp"
#include "bindings/convert.hpp"
#include "debulk/scanner/decode.hpp"
#include "debulk/scanner/lens_blur.hpp"
#include "debulk/scanner/neighbours.hpp"
#include "debulk/scanner/row_shift.hpp"
#include "debulk/scanner/sensor_noise.hpp"
#include "debulk/scanner/stereo.hpp"
#include "debulk/scanner/unwrap_plan.hpp"

namespace debulk {
namespace {

using Plane = py::array_t<float, py::array::c_style>;

// Returns the memory into which a map is to be written, or null for None. The array is not converted, because the map
// must go into the caller's own memory.
template <class T>
T* target(const py::object& a, const std::vector<py::ssize_t>& shape, const char* name) {
  if (a.is_none()) return nullptr;
  require(py::isinstance<py::array_t<T, py::array::c_style>>(a), name, "a C-contiguous array of the map's type", "another");
  auto array = py::reinterpret_borrow<py::array_t<T, py::array::c_style>>(a);
  require(std::vector<py::ssize_t>(array.shape(), array.shape() + array.ndim()) == shape, name, "an array as large as the images",
          shape_of(array));
  return array.mutable_data();
}

const float* source(const py::object& a, int height, int width, const char* name) {
  return target<float>(a, {height, width}, name);
}

// The images of one camera in one list; their memory belongs to Python.
template <class T>
struct Images {
  ImageStack<T> stack;
  int width = 0, height = 0;
  Images(const std::vector<py::array>& images, int exposures) {
    for (const py::array& image : images) {
      require(py::isinstance<py::array_t<T, py::array::c_style>>(image) && image.ndim() == 2, "images",
              "C-contiguous (H, W) arrays of one type", shape_of(image));
      if (stack.images.empty()) width = static_cast<int>(image.shape(1)), height = static_cast<int>(image.shape(0));
      require(image.shape(0) == height && image.shape(1) == width, "images", "arrays of one shape", shape_of(image));
      stack.images.push_back(static_cast<const T*>(image.data()));
    }
    require(exposures >= 1 && !images.empty() && images.size() % static_cast<std::size_t>(exposures) == 0, "images",
            "as many for each exposure", images.size());
    stack.exposures = exposures, stack.pixels = static_cast<long>(width) * height;
  }
};

// Returns the widest instruction set that is both allowed and present: 2 (SSE4), 3 (AVX2) or 4 (AVX-512). Tests compare
// their results.
Isa widest_isa(int widest) {
  return std::min(best_isa(), widest <= 2 ? Isa::base : widest == 3 ? Isa::v3 : Isa::v4);
}

bool bytes(const std::vector<py::array>& images) {
  return !images.empty() && py::isinstance<py::array_t<std::uint8_t>>(images[0]);
}

template <class T>
SensorNoise noise_of(const std::vector<py::array>& images, int exposures, int steps, double saturated, int threads, const Stop& stop) {
  const Images<T> from(images, exposures);
  require(steps >= 3 && from.stack.images_each() % steps == 0 && from.stack.images_each() >= 2 * steps, "steps",
          "a divisor of the number of images", steps);
  py::gil_scoped_release release;
  return estimate_noise(from.stack, steps, saturated, from.width, threads, stop);
}

// planes: what is kept of the best exposure, (2 + numbers of periods, pixels), and of the one that is coming, (1 + numbers
// of periods, pixels) or None, float32; and the exposures, (pixels,) uint8. Pixels are rounded up to groups of sixteen.
Arrived arrived_of(const py::tuple& planes, const Decoding& how, long pixels) {
  require(planes.size() == 3, "planes", "three", planes.size());
  const py::ssize_t each = (pixels + 15) / 16 * 16, periods = static_cast<py::ssize_t>(how.plan.periods.size());
  const auto cut = [&](const py::object& from, py::ssize_t count) {
    Planes out;
    float* at = target<float>(from, {2 + count, each}, "planes");
    if (!at) return out;
    out.offset = at, out.modulation = at + each;
    for (py::ssize_t p = 0; p < count; ++p) out.wrapped[static_cast<std::size_t>(p)] = at + (2 + p) * each;
    return out;
  };
  Arrived out{cut(planes[0], periods), cut(planes[1], periods - 1), target<std::uint8_t>(planes[2], {each}, "planes")};
  require(out.best.offset && out.exposure, "planes", "arrays", "None");
  return out;
}

template <class T>
void take_images(const std::vector<py::array>& images, const Place& place, const Decoding& how, const py::tuple& planes, const Stop& stop) {
  const Images<T> from(images, 1);
  const Arrived kept = arrived_of(planes, how, from.stack.pixels);
  py::gil_scoped_release release;
  take_in(from.stack.images, from.stack.pixels, place, how, kept, stop);
}

template <class T>
py::dict decode_into(const std::vector<py::array>& images, int exposures, const Decoding& how, const py::dict& maps, const Stop& stop,
                     const py::object& planes) {
  const Images<T> from(images, exposures);
  Arrived arrived;
  if (!planes.is_none()) arrived = arrived_of(py::cast<py::tuple>(planes), how, from.stack.pixels);
  const std::vector<py::ssize_t> shape = {from.height, from.width};
  const auto wanted = [&](const char* name) -> py::object { return maps.contains(name) ? py::object(maps[name]) : py::none(); };
  PhaseMaps out;
  out.phase = target<float>(wanted("phase"), shape, "phase"), out.noise = target<float>(wanted("noise"), shape, "noise");
  out.modulation = target<float>(wanted("modulation"), shape, "modulation"), out.offset = target<float>(wanted("offset"), shape, "offset");
  out.residual = target<float>(wanted("residual"), shape, "residual"),
  out.exposure = target<std::uint8_t>(wanted("exposure"), shape, "exposure");
  DecodeCounts counts;
  NeighbourCounts beside;
  {
    py::gil_scoped_release release;
    counts = decode(from.stack, how, out, stop, planes.is_none() ? nullptr : &arrived);
    if (out.phase) beside = check_neighbours(out.phase, from.width, from.height, order_step(how.plan), how.threads, stop, how.isa);
  }
  py::dict result;
  result["lit"] = counts.lit, result["saturated"] = counts.saturated, result["doubtful"] = counts.doubtful;
  result["isolated"] = beside.isolated, result["repaired"] = beside.repaired, result["read"] = counts.read;
  return result;
}

// parts: (phase, noise or None, map_x or None, map_y or None)
PhaseView view_of(const py::tuple& parts, const char* name) {
  require(parts.size() == 4, name, "phase, noise, map_x and map_y", parts.size());
  PhaseView view;
  const Plane phase = py::cast<Plane>(parts[0]);
  require(phase.ndim() == 2 && phase.data() == py::cast<py::array>(parts[0]).data(), name, "a C-contiguous (H, W) array of float32",
          shape_of(phase));
  view.width = static_cast<int>(phase.shape(1)), view.height = static_cast<int>(phase.shape(0));
  view.phase = phase.data(), view.noise = source(parts[1], view.height, view.width, name);
  view.rectified_width = view.width, view.rectified_height = view.height;
  if (!parts[2].is_none()) {
    const py::array map = py::cast<py::array>(parts[2]);
    require(map.ndim() == 2, name, "maps of shape (H, W)", shape_of(map));
    view.rectified_height = static_cast<int>(map.shape(0)), view.rectified_width = static_cast<int>(map.shape(1));
    view.map_x = source(parts[2], view.rectified_height, view.rectified_width, name);
    view.map_y = source(parts[3], view.rectified_height, view.rectified_width, name);
    require(view.map_y != nullptr, name, "map_y beside map_x", "None");
  }
  return view;
}

// parts: (modulation, exposure, brightness, map_x, map_y)
SeenTexture texture_of(const py::tuple& parts, py::ssize_t height, const char* name) {
  require(parts.size() == 5, name, "modulation, exposure, brightness, map_x and map_y", parts.size());
  const py::array modulation = py::cast<py::array>(parts[0]), map = py::cast<py::array>(parts[3]);
  require(modulation.ndim() == 2 && map.ndim() == 2, name, "(H, W) arrays", shape_of(map));
  const std::vector<py::ssize_t> shape = {modulation.shape(0), modulation.shape(1)};
  SeenTexture seen;
  seen.height = static_cast<int>(shape[0]), seen.width = static_cast<int>(shape[1]);
  seen.modulation = target<float>(parts[0], shape, name), seen.exposure = target<std::uint8_t>(parts[1], shape, name);
  seen.brightness = py::cast<std::vector<float>>(parts[2]);
  const py::ssize_t width = map.shape(1);
  seen.rectified_width = static_cast<int>(width);
  seen.map_x = target<float>(parts[3], {height, width}, name), seen.map_y = target<float>(parts[4], {height, width}, name);
  require(seen.exposure && seen.map_x && seen.map_y, name, "maps", "None");
  return seen;
}

}  // namespace

void bind_scanner(py::module_ m) {
  m.def(
      "unwrap_stages",
      [](const std::vector<int>& periods) {
        const UnwrapPlan plan = plan_unwrapping(periods);
        std::vector<std::pair<int, std::vector<int>>> stages;
        for (const Synthetic& s : plan.stages)
          stages.emplace_back(s.periods,
                              std::vector<int>(s.weights.begin(), s.weights.begin() + static_cast<std::ptrdiff_t>(periods.size())));
        return std::make_pair(stages, plan.order_noise);
      },
      py::arg("periods"), "The stages (periods, weights), and the noise of the least certain order for a phase noise of one turn.");

  m.def(
      "sensor_noise",
      [](const std::vector<py::array>& images, int exposures, int steps, double saturated, int threads, const Stop& stop) {
        const SensorNoise noise = bytes(images) ? noise_of<std::uint8_t>(images, exposures, steps, saturated, threads, stop)
                                                : noise_of<std::uint16_t>(images, exposures, steps, saturated, threads, stop);
        return std::make_pair(noise.read, noise.gain);
      },
      py::arg("images"), py::arg("exposures"), py::arg("steps"), py::arg("saturated"), py::arg("threads"), py::arg("stop"));

  m.def(
      "decode",
      [](const std::vector<py::array>& images, int exposures, const std::vector<int>& periods, int steps, double saturated,
         std::pair<double, double> noise, double start, const py::dict& maps, int threads, int widest, const Stop& stop,
         const py::object& planes) {
        Decoding how;
        how.steps = steps, how.plan = plan_unwrapping(periods), how.saturated = saturated;
        how.noise = {noise.first, noise.second}, how.start = start, how.threads = threads;
        how.isa = widest_isa(widest);
        return bytes(images) ? decode_into<std::uint8_t>(images, exposures, how, maps, stop, planes)
                             : decode_into<std::uint16_t>(images, exposures, how, maps, stop, planes);
      },
      py::arg("images"), py::arg("exposures"), py::kw_only(), py::arg("periods"), py::arg("steps"), py::arg("saturated"), py::arg("noise"),
      py::arg("start"), py::arg("maps"), py::arg("threads"), py::arg("widest"), py::arg("stop"), py::arg("planes") = py::none());

  m.def(
      "take_in",
      [](const std::vector<py::array>& images, int exposure, int period, const std::vector<int>& periods, double saturated,
         const py::tuple& planes, int threads, int widest, const Stop& stop) {
        Decoding how;
        how.steps = static_cast<int>(images.size()), how.plan = plan_unwrapping(periods), how.saturated = saturated;
        how.threads = threads, how.isa = widest_isa(widest);
        return bytes(images) ? take_images<std::uint8_t>(images, {exposure, period}, how, planes, stop)
                             : take_images<std::uint16_t>(images, {exposure, period}, how, planes, stop);
      },
      py::arg("images"), py::arg("exposure"), py::arg("period"), py::kw_only(), py::arg("periods"), py::arg("saturated"), py::arg("planes"),
      py::arg("threads"), py::arg("widest"), py::arg("stop"),
      "Takes the steps of one number of periods into planes, from which and the last ones decode() then makes the maps.");

  m.def(
      "check_neighbours",
      [](const Plane& phase, double order_step, int threads, int widest, const Stop& stop) {
        require(phase.ndim() == 2, "phase", "an (H, W) array", shape_of(phase));
        const int height = static_cast<int>(phase.shape(0)), width = static_cast<int>(phase.shape(1));
        float* phases = target<float>(phase, {height, width}, "phase");
        NeighbourCounts counts;
        {
          py::gil_scoped_release release;
          counts = check_neighbours(phases, width, height, order_step, threads, stop, widest_isa(widest));
        }
        py::dict result;
        result["isolated"] = counts.isolated, result["repaired"] = counts.repaired;
        return result;
      },
      py::arg("phase").noconvert(), py::arg("order_step"), py::arg("threads"), py::arg("widest"), py::arg("stop"),
      "Removes phases unlike their neighbours', and decides doubtful ones (-1 - phase) by them; the counts of both.");

  m.def(
      "take_out_blur",
      [](const Plane& phase, const py::object& modulation, const py::object& exposure, const std::vector<float>& brightness,
         double variance_px2, int threads, int widest, const Stop& stop) {
        require(phase.ndim() == 2, "phase", "an (H, W) array", shape_of(phase));
        const py::ssize_t height = phase.shape(0), width = phase.shape(1);
        FringeLight light;
        light.modulation = target<float>(modulation, {height, width}, "modulation");
        light.exposure = target<std::uint8_t>(exposure, {height, width}, "exposure");
        require(light.modulation && light.exposure && !brightness.empty() && brightness.size() < light.gain.size(), "modulation, exposure",
                "maps and the brightness of each exposure", brightness.size());
        for (std::size_t e = 0; e < brightness.size(); ++e) light.gain[e] = 1.0f / brightness[e];
        light.width = static_cast<int>(width), light.height = static_cast<int>(height);
        float* phases = target<float>(phase, {height, width}, "phase");
        py::gil_scoped_release release;
        const double variance = variance_px2 < 0 ? estimate_blur(phases, light, threads, stop) : variance_px2;
        take_out_blur(phases, light, variance, threads, stop, widest_isa(widest));
        return variance;
      },
      py::arg("phase").noconvert(), py::arg("modulation"), py::arg("exposure"), py::arg("brightness"), py::arg("variance_px2"),
      py::arg("threads"), py::arg("widest"), py::arg("stop"), "Returns the variance: the given one, or the estimate for a negative one.");

  m.def(
      "match",
      [](const py::tuple& left, const py::tuple& right, const std::vector<double>& geometry, const py::dict& maps, int threads, int widest,
         const Stop& stop) {
        const PhaseView from_left = view_of(left, "left"), from_right = view_of(right, "right");
        require(geometry.empty() || geometry.size() == 7, "geometry", "focal, left_cx, right_cx, cy, baseline, nearest, furthest",
                geometry.size());
        StereoGeometry g;
        if (!geometry.empty()) g = {geometry[0], geometry[1], geometry[2], geometry[3], geometry[4], geometry[5], geometry[6]};
        const py::ssize_t height = from_left.rectified_height, width = from_left.rectified_width;
        const auto wanted = [&](const char* name) -> py::object { return maps.contains(name) ? py::object(maps[name]) : py::none(); };
        StereoMaps out;
        out.disparity = target<float>(wanted("disparity"), {height, width}, "disparity"),
        out.sigma = target<float>(wanted("sigma"), {height, width}, "sigma");
        out.points = target<float>(wanted("points"), {height, width, 3}, "points");
        out.uncertainty = target<float>(wanted("uncertainty"), {height, width}, "uncertainty");
        StereoOptions options;
        options.threads = threads, options.isa = widest_isa(widest);
        MatchCounts counts;
        {
          py::gil_scoped_release release;
          counts = match_rows(from_left, from_right, geometry.empty() ? nullptr : &g, options, out, stop);
        }
        py::dict result;
        result["seen"] = counts.seen, result["matched"] = counts.matched, result["unmatched"] = counts.unmatched;
        result["ambiguous"] = counts.ambiguous, result["behind"] = counts.behind;
        return result;
      },
      py::arg("left"), py::arg("right"), py::arg("geometry"), py::arg("maps"), py::kw_only(), py::arg("threads"), py::arg("widest"),
      py::arg("stop"));

  m.def(
      "row_shifts",
      [](const std::vector<std::pair<int, int>>& places, int step, const Plane& points, double depth_px, double shift,
         const py::tuple& left, const py::tuple& right, int threads, const Stop& stop) {
        require(points.ndim() == 3 && points.shape(2) == 3, "points", "an (H, W, 3) array", shape_of(points));
        const py::ssize_t height = points.shape(0), width = points.shape(1);
        const RowMatches matches{points.data(), static_cast<int>(width), static_cast<int>(height), static_cast<float>(depth_px),
                                 static_cast<float>(shift)};
        const SeenTexture from_left = texture_of(left, height, "left"), from_right = texture_of(right, height, "right");
        std::vector<PatchPlace> at;
        for (const auto& [column, row] : places) at.push_back({column, row});
        std::vector<RowShift> found;
        {
          py::gil_scoped_release release;
          found = row_shifts(at, step, matches, from_left, from_right, threads, stop);
        }
        py::list result;
        for (const RowShift& one : found) result.append(py::make_tuple(one.textured, one.correlation, one.rows));
        return result;
      },
      py::arg("places"), py::arg("step"), py::arg("points").noconvert(), py::arg("depth_px"), py::arg("shift"), py::arg("left"),
      py::arg("right"), py::kw_only(), py::arg("threads"), py::arg("stop"),
      "Whether the patch round each place (column, row) has texture, its best correlation, and the rows between the images there.");
  m.attr("patch_half") = patch_half, m.attr("row_reach") = row_reach;
}

}  // namespace debulk
