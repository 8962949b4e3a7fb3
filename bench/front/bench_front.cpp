// Times the front end stage by stage, and one reading of the cloud in the same run. make_scene.py makes the scenes.
//   DEBULK_SCENES=build/scenes build/bench/bench/front/bench_front
// Times are wall times of the best repetition. "reads" is the time in units of one reading of the cloud. "memory" is
// the memory that the front end and the segmentation keep, in units of the cloud. "busy" is the processors' time
// divided by the threads: the wall time on a machine with nothing else to do, if all stages were wholly parallel.

#include <benchmark/benchmark.h>

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <utility>
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
const OutlierOptions outlier_options{4, 1.0, 2.0};

double since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// Memory allocated as NumPy does for a large array: in huge pages if the system allows them.
class Points {
 public:
  explicit Points(std::size_t points = 0) : bytes_((3 * points * sizeof(float) + huge - 1) / huge * huge) {
    if (bytes_ == 0) return;
    data_ = static_cast<float*>(std::aligned_alloc(huge, bytes_));
    madvise(data_, bytes_, MADV_HUGEPAGE);
  }
  Points(Points&& other) noexcept : bytes_(other.bytes_), data_(std::exchange(other.data_, nullptr)) {}
  Points& operator=(Points&& other) noexcept {
    std::swap(bytes_, other.bytes_), std::swap(data_, other.data_);
    return *this;
  }
  ~Points() { std::free(data_); }
  float* data() const { return data_; }

 private:
  static constexpr std::size_t huge = std::size_t{1} << 21;
  std::size_t bytes_;
  float* data_ = nullptr;
};

// Returns the CPU time of all threads, ms.
double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct Scene {
  int width = 0, height = 0;
  Points scan;
  Polygon outline;
  Pinhole camera;
  double before_mb = 0;  // memory of the process before the front end was made
  std::unique_ptr<FrontEnd> front;

  CloudView cloud() const { return {scan.data(), width, height}; }
};

double resident_mb() {
  malloc_trim(0);
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

Points read_points(const std::string& path, std::size_t points) {
  Points values(points);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(3 * points * sizeof(float)));
  if (!file) std::fprintf(stderr, "bench_front: %s could not be read\n", path.c_str()), std::exit(1);
  return values;
}

// Loads the scan and does everything that a cell prepares before its first cycle. The options are the recipe's.
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
  scene->camera = view.camera;
  std::ifstream corners(stem + ".outline");
  for (double x = 0, y = 0; corners >> x >> y;) scene->outline.emplace_back(x, y);

  FrontEndOptions options;
  options.outliers = outlier_options;
  options.spike = 0.5;
  Grid<float> heights;
  const Points reference = read_points(stem + ".reference", points);
  {
    PinholeOutliers clean;
    clean.run({reference.data(), width, height}, view.camera, options.outliers, nullptr, threads);
    std::vector<float> moved = transform({reference.data(), width, height}, view.mold_from_scanner, threads);
    for (std::size_t k = 0; k < points; ++k)
      if (!clean.keep()[k]) std::fill_n(&moved[3 * k], 3, std::numeric_limits<float>::quiet_NaN());
    const CloudView below{moved.data(), width, height};
    const CloudBounds box = bounds(below, threads);
    options.spacing = std::max(0.5, median_pitch(below, threads));
    heights = covering_grid(box.low.head<2>(), box.high.head<2>(), options.spacing);
    grid_heights(below, heights, {}, threads);
  }
  const auto surface = std::make_shared<Reference>(fit_reference(heights, {}, threads));
  scene->before_mb = resident_mb() - 12e-6 * static_cast<double>(points);  // without the reference's points, which are freed
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
  scene->front = std::make_unique<FrontEnd>(surface, -far, far, view, true, options, threads);
  scene->front->run({reference.data(), width, height});  // the reference's own threshold serves as the first guess
  return scene;
}

double reading_ms(const Scene& scene) {
  const auto begin = Clock::now();
  const float* values = scene.scan.data();
  parallel_for(3L * scene.width * scene.height, 1 << 18, threads, [&](long from, long to) {
    float sums[64] = {};
    for (long k = from; k + 64 <= to; k += 64)
      for (int lane = 0; lane < 64; ++lane) sums[lane] += values[k + lane];
    benchmark::DoNotOptimize(sums);
  });
  return since(begin);
}

// Accepts the neighbours in the pixel window without a certificate, to measure the time saved and the number of wrong
// decisions.
void short_cut(benchmark::State& state, const Scene& scene) {
  double best[2] = {1e300, 1e300};
  std::vector<std::uint8_t> keep[2];
  for (const int certified : {1, 0}) {
    PinholeOutliers clean;
    clean.certified = certified != 0;
    for (int k = 0; k < 4; ++k) {
      const double cpu = cpu_ms();
      clean.run(scene.cloud(), scene.camera, outlier_options, nullptr, threads);
      best[certified] = std::min(best[certified], (cpu_ms() - cpu) / threads);
    }
    keep[certified] = clean.keep();
  }
  long wrong = 0;
  for (std::size_t k = 0; k < keep[0].size(); ++k) wrong += keep[0][k] != keep[1][k];
  state.counters["certified_busy_ms"] = best[1];
  state.counters["window_busy_ms"] = best[0];
  state.counters["window_wrong"] = static_cast<double>(wrong);
  state.counters["removed"] = static_cast<double>(std::count(keep[1].begin(), keep[1].end(), 0));
}

void cycle(benchmark::State& state, const std::string& stem, int width, int height) {
  const std::unique_ptr<Scene> scene = load(stem, width, height);
  SegmentOptions wanted;
  wanted.ply_outline = scene->outline;
  wanted.smooth_mm = 8;
  Segmenter segmenter;
  constexpr double never = 1e300;
  double read = never, whole = never, segmenting = never, busy = never, reading = never;
  FrontEnd::Times best{never, never, never, never, never};
  std::size_t pockets = 0;
  for (auto step : state) {
    (void)step;
    double cpu = cpu_ms();
    read = std::min(read, reading_ms(*scene));
    reading = std::min(reading, (cpu_ms() - cpu) / threads);
    cpu = cpu_ms();
    const auto begin = Clock::now();
    const HeightMap& map = scene->front->run(scene->cloud());
    const auto middle = Clock::now();
    wanted.blur_mm2 = scene->front->blur_mm2();
    pockets = segmenter.run(map.heights, wanted, &map.measured, &map.before_median, threads).pockets.size();
    segmenting = std::min(segmenting, since(middle));
    const double passed = since(begin);
    whole = std::min(whole, passed);
    busy = std::min(busy, (cpu_ms() - cpu) / threads);
    state.SetIterationTime(passed / 1e3);
    const FrontEnd::Times& t = scene->front->times();
    best = {std::min(best.clean, t.clean), std::min(best.grid, t.grid), std::min(best.fill, t.fill), std::min(best.spikes, t.spikes),
            std::min(best.median, t.median)};
  }
  const double cloud_mb = 12e-6 * width * height;
  state.counters["memory"] = (resident_mb() - scene->before_mb) / cloud_mb;  // in units of the cloud
  state.counters["read_ms"] = read;
  state.counters["clean_ms"] = best.clean;
  state.counters["grid_ms"] = best.grid;
  state.counters["fill_ms"] = best.fill;
  state.counters["spikes_ms"] = best.spikes;
  state.counters["median_ms"] = best.median;
  state.counters["segment_ms"] = segmenting;
  state.counters["best_ms"] = whole;
  state.counters["points"] = static_cast<double>(width) * height;
  state.counters["busy_ms"] = busy;
  state.counters["read_busy_ms"] = reading;
  state.counters["reads"] = whole / read;
  state.counters["ns_per_point"] = whole * 1e6 / width / height;
  state.counters["GB_s"] = cloud_mb / read;
  state.counters["pockets"] = static_cast<double>(pockets);
  state.counters["fast"] = scene->front->fast();
  short_cut(state, *scene);
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
        ->Iterations(size > 500'000'000 ? 5 : 15);
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
