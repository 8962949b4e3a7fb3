// Measures for how long a solve of about 1000 nodes continues after its stop is raised, with its edge held, or with
// half of the edge free and the minimum far away. It measures CPU time, which other programs on the machine do not
// lengthen, for stops at many places in the solve.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>

#include "debulk/sheet/minimise.hpp"
#include "support/shapes.hpp"

namespace debulk {
namespace {

double cpu_ms() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// A mold that raises the stop after a given number of samples and records the time.
struct Impatient : test::Quadric {
  explicit Impatient(long most) : Quadric(-1e-3, 0, 2e-3), left(most) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    if (--left == 0) {
      raised_ms = cpu_ms();
      stop.cancel();
    }
    return Quadric::sample(p);
  }
  mutable long left;
  mutable double raised_ms = 0;
  Stop stop;
};

Net large_net(bool half_free) {
  Net net = test::flat_net(32, 32, 5.0);
  const double reach = 80;
  const Eigen::Vector3d centre(77.5, 77.5, 0);
  for (std::size_t i = 0; i < net.nodes.size(); ++i) {
    Eigen::Vector3d& p = net.nodes[i];
    if (half_free && net.kinds[i] == NodeKind::fixed && p.x() > 80) net.kinds[i] = NodeKind::free;
    const double r = std::min(1.0, (p - centre).norm() / reach);
    p.z() += (half_free ? 15 : 4) * std::pow(std::cos(M_PI / 2 * r), 2);
  }
  return net;
}

// Stops at 10 places of a whole solve, including the certificate, or of its first kMost samples if it takes more.
void after_the_stop(benchmark::State& state) {
  constexpr long kMost = 100000, kStops = 10;
  std::vector<double> late_ms;
  const auto solve = [&](long most) {
    auto mold = std::make_shared<Impatient>(most);
    const Sheet sheet(large_net(state.range(0)), 25.0 * 32 * 32, PlyMaterial(), mold);
    MinimiseOptions options;
    options.solve.stop = mold->stop;
    benchmark::DoNotOptimize(minimise(sheet, options));
    return mold;
  };
  for (auto _ : state) {
    const auto whole = solve(kMost);
    const long samples = kMost - std::max(0L, whole->left);
    for (long k = 1; k <= kStops; ++k) {
      const auto mold = solve(std::max(1L, samples * k / kStops));
      late_ms.push_back(cpu_ms() - mold->raised_ms);
    }
  }
  std::sort(late_ms.begin(), late_ms.end());
  state.counters["nodes"] = 1024;
  state.counters["median_ms"] = late_ms[late_ms.size() / 2];
  state.counters["worst_ms"] = late_ms.back();
}
BENCHMARK(after_the_stop)->ArgName("half_free")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace debulk
