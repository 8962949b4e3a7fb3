// Solves the 14 pockets of the virtual layup, from net to certified minimum, without a warm start. Reports the median
// and the worst of each pocket's best time over the runs, and the time for all pockets in parallel.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>

#include "debulk/core/parallel.hpp"
#include "debulk/sheet/minimise.hpp"
#include "solve/pocket_file.hpp"

namespace debulk::bench {
namespace {

double milliseconds_since(std::chrono::steady_clock::time_point then) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - then).count();
}

void one_by_one(benchmark::State& state, const std::string& method) {
  MinimiseOptions options;
  options.method = method;
  std::vector<double> best_ms(pockets().size(), 1e300), all;
  double certified = 0, iterations = 0;
  for (auto _ : state) {
    certified = iterations = 0;
    for (std::size_t k = 0; k < pockets().size(); ++k) {
      const auto then = std::chrono::steady_clock::now();
      const Sheet sheet = pockets()[k].sheet();
      const std::vector<Minimum> minima = minimise(sheet, options);
      const double ms = milliseconds_since(then);
      all.push_back(ms);
      best_ms[k] = std::min(best_ms[k], ms);
      certified += best(minima).certified();
      iterations += minima[0].iterations;
    }
  }
  if (best_ms.empty()) return state.SkipWithError("no pockets: run export_pockets.py first");
  const auto count = static_cast<double>(best_ms.size());
  std::sort(best_ms.begin(), best_ms.end());
  std::sort(all.begin(), all.end());
  state.counters["pockets"] = count;
  state.counters["certified"] = certified;
  state.counters["iterations"] = iterations / count;
  state.counters["best_median_ms"] = (best_ms[best_ms.size() / 2] + best_ms[(best_ms.size() - 1) / 2]) / 2;
  state.counters["best_worst_ms"] = best_ms.back();
  state.counters["all_median_ms"] = all[all.size() / 2];
  state.counters["all_worst_ms"] = all.back();
}

void together(benchmark::State& state) {
  std::vector<Sheet> sheets;
  for (const Pocket& pocket : pockets()) sheets.push_back(pocket.sheet());
  double best_ms = 1e300;
  for (auto _ : state) {
    const auto then = std::chrono::steady_clock::now();
    parallel_for(static_cast<long>(sheets.size()), 1, static_cast<int>(state.range(0)),
                 [&](long k, long) { benchmark::DoNotOptimize(minimise(sheets[static_cast<std::size_t>(k)], MinimiseOptions())); });
    best_ms = std::min(best_ms, milliseconds_since(then));
  }
  if (sheets.empty()) return state.SkipWithError("no pockets: run export_pockets.py first");
  state.counters["best_ms"] = best_ms;
}

BENCHMARK_CAPTURE(one_by_one, interior_point, "interior_point")->Unit(benchmark::kMillisecond)->Iterations(15);
BENCHMARK_CAPTURE(one_by_one, ipopt, "ipopt")->Unit(benchmark::kMillisecond)->Iterations(2);
BENCHMARK_CAPTURE(one_by_one, nlopt, "nlopt")->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(together)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(15);

}  // namespace
}  // namespace debulk::bench
