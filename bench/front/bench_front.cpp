// The front end, stage by stage, beside one reading of the cloud in the same run. Scenes: make_scene.py.
//   DEBULK_SCENES=build/scenes build/bench/bench/front/bench_front
// Times are wall times of the best repetition; "reads" is the time in readings of the cloud.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "debulk/cloud/pitch.hpp"
#include "debulk/cloud/transform.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/pocket/segment.hpp"
#include "debulk/surface/fit_reference.hpp"
#include "debulk/surface/front_end.hpp"

namespace {

using namespace debulk;
using Clock = std::chrono::steady_clock;

constexpr int threads = 2;

double since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

struct Scene {
  int width = 0, height = 0;
  std::vector<float> scan;
  Polygon outline;
  std::unique_ptr<FrontEnd> front;

  CloudView cloud() const { return {scan.data(), width, height}; }
};

std::vector<float> read_points(const std::string& path, std::size_t points) {
  std::vector<float> values(3 * points);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
  if (!file) std::fprintf(stderr, "bench_front: %s could not be read\n", path.c_str()), std::exit(1);
  return values;
}

// The scan and everything that a cell prepares before its first cycle.
std::unique_ptr<Scene> load(const std::string& stem, int width, int height) {
  auto scene = std::make_unique<Scene>();
  scene->width = width, scene->height = height;
  const std::size_t points = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  scene->scan = read_points(stem + ".scan", points);
  View view;
  view.width = width, view.height = height;
  std::ifstream numbers(stem + ".view");
  for (int k = 0; k < 16; ++k) numbers >> view.mold_from_scanner(k / 4, k % 4);
  numbers >> view.camera.f >> view.camera.cx >> view.camera.cy;
  std::ifstream corners(stem + ".outline");
  for (double x = 0, y = 0; corners >> x >> y;) scene->outline.emplace_back(x, y);

  const std::vector<float> reference = read_points(stem + ".reference", points);
  const OutlierOptions outliers{4, 1.0, 2.0};
  PinholeOutliers clean;
  clean.run({reference.data(), width, height}, view.camera, outliers, nullptr, threads);
  std::vector<float> moved = transform({reference.data(), width, height}, view.mold_from_scanner, threads);
  for (std::size_t k = 0; k < points; ++k)
    if (!clean.keep()[k]) std::fill_n(&moved[3 * k], 3, std::numeric_limits<float>::quiet_NaN());
  const CloudView below{moved.data(), width, height};
  const CloudBounds box = bounds(below, threads);
  FrontEndOptions options;
  options.outliers = outliers;
  options.spacing = std::max(0.5, median_pitch(below, threads));
  Grid<float> heights = covering_grid(box.low.head<2>(), box.high.head<2>(), options.spacing);
  grid_heights(below, heights, {}, threads);
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
  scene->front =
      std::make_unique<FrontEnd>(std::make_shared<Reference>(fit_reference(heights, {}, threads)), -far, far, view, true, options, threads);
  scene->front->run({reference.data(), width, height});  // the reference's own threshold is the first guess
  return scene;
}

double reading_ms(const Scene& scene) {
  const auto begin = Clock::now();
  parallel_for(static_cast<long>(scene.scan.size()), 1 << 18, threads, [&](long from, long to) {
    float sums[16] = {};
    for (long k = from; k + 16 <= to; k += 16)
      for (int lane = 0; lane < 16; ++lane) sums[lane] += scene.scan[static_cast<std::size_t>(k + lane)];
    benchmark::DoNotOptimize(sums);
  });
  return since(begin);
}

void cycle(benchmark::State& state, const std::string& stem, int width, int height) {
  const std::unique_ptr<Scene> scene = load(stem, width, height);
  SegmentOptions wanted;
  wanted.ply_outline = scene->outline;
  constexpr double never = 1e300;
  double read = never, whole = never, segmenting = never;
  FrontEnd::Times best{never, never, never, never};
  std::size_t pockets = 0;
  for (auto step : state) {
    (void)step;
    read = std::min(read, reading_ms(*scene));
    const auto begin = Clock::now();
    const HeightMap& map = scene->front->run(scene->cloud());
    const auto middle = Clock::now();
    pockets = segment(map.heights, wanted, &map.measured).pockets.size();
    segmenting = std::min(segmenting, since(middle));
    const double passed = since(begin);
    whole = std::min(whole, passed);
    state.SetIterationTime(passed / 1e3);
    const FrontEnd::Times& t = scene->front->times();
    best = {std::min(best.clean, t.clean), std::min(best.grid, t.grid), std::min(best.fill, t.fill), std::min(best.median, t.median)};
  }
  state.counters["read_ms"] = read;
  state.counters["clean_ms"] = best.clean;
  state.counters["grid_ms"] = best.grid;
  state.counters["fill_ms"] = best.fill;
  state.counters["median_ms"] = best.median;
  state.counters["segment_ms"] = segmenting;
  state.counters["best_ms"] = whole;
  state.counters["reads"] = whole / read;
  state.counters["GB_s"] = static_cast<double>(scene->scan.size()) * sizeof(float) / read / 1e6;
  state.counters["pockets"] = static_cast<double>(pockets);
  state.counters["fast"] = scene->front->fast();
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const char* folder = std::getenv("DEBULK_SCENES");
  if (!folder) return std::fprintf(stderr, "bench_front: set DEBULK_SCENES to a directory written by make_scene.py\n"), 1;
  std::vector<std::pair<long, std::string>> stems;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".scan") stems.emplace_back(static_cast<long>(entry.file_size()), entry.path().stem().string());
  std::sort(stems.begin(), stems.end());
  for (const auto& [size, name] : stems) {
    int width = 0, height = 0;
    if (std::sscanf(name.c_str(), "%dx%d", &width, &height) != 2) continue;
    const std::string stem = std::string(folder) + "/" + name;
    benchmark::RegisterBenchmark(("front/" + name).c_str(), [=](benchmark::State& state) { cycle(state, stem, width, height); })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(9);
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
