// Energy, gradient and Hessian of nets of 100 to 10 000 nodes: time per node and number of memory allocations, which
// should be 0.
#include <benchmark/benchmark.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "debulk/sheet/gap_problem.hpp"
#include "support/shapes.hpp"

namespace {
std::atomic<long> allocations{0};
}

// Not inlined, because GCC would report malloc and free in one function as a mismatch.
__attribute__((noinline)) void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
__attribute__((noinline)) void operator delete(void* p) noexcept {
  std::free(p);
}
__attribute__((noinline)) void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

namespace debulk {
namespace {

Net bell_net(int side) {
  Net net = test::flat_net(side, side, 5.0);
  const Eigen::Vector3d centre = net.nodes[net.nodes.size() / 2];
  const double reach = 2.5 * side;
  for (Eigen::Vector3d& p : net.nodes) p.z() = 0.2 * reach * std::exp(-(p - centre).squaredNorm() / (0.2 * reach * reach));
  net.nodes = test::shaken(net.nodes, 0.2, 1);
  return net;
}

class Nets : public benchmark::Fixture {
 public:
  using benchmark::Fixture::SetUp;
  void SetUp(const benchmark::State& state) override {
    const int side = static_cast<int>(state.range(0));
    sheet = std::make_unique<Sheet>(bell_net(side), 25.0 * side * side, PlyMaterial(), std::make_shared<test::Quadric>(1e-4, 0, -1e-4));
    gradient.assign(sheet->start().size(), Eigen::Vector3d::Zero());
    hessian = sheet->movable_hessian();
  }
  template <class Work>
  void run(benchmark::State& state, const Work& work) const {
    long allocated = 0;
    for (auto _ : state) {
      const long before = allocations;
      work();
      allocated += allocations - before;
    }
    const auto nodes = static_cast<double>(sheet->start().size());
    state.counters["nodes"] = nodes;
    state.counters["allocations"] = static_cast<double>(allocated);
    state.counters["a_node"] = benchmark::Counter(nodes, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  }

  std::unique_ptr<Sheet> sheet;
  Points gradient;
  BlockMatrix hessian;
};

BENCHMARK_DEFINE_F(Nets, energy)(benchmark::State& state) {
  run(state, [&] { benchmark::DoNotOptimize(sheet->energy(sheet->start())); });
}
BENCHMARK_DEFINE_F(Nets, energy_gradient)(benchmark::State& state) {
  run(state, [&] { benchmark::DoNotOptimize(sheet->add_gradient(sheet->start(), gradient)); });
}
BENCHMARK_DEFINE_F(Nets, energy_gradient_hessian)(benchmark::State& state) {
  run(state, [&] {
    benchmark::DoNotOptimize(sheet->add_gradient(sheet->start(), gradient));
    hessian.set_zero();
    sheet->add_movable_hessian(sheet->start(), hessian);
  });
}
BENCHMARK_REGISTER_F(Nets, energy)->Arg(10)->Arg(18)->Arg(32)->Arg(56)->Arg(100)->Unit(benchmark::kMicrosecond);
BENCHMARK_REGISTER_F(Nets, energy_gradient)->Arg(10)->Arg(18)->Arg(32)->Arg(56)->Arg(100)->Unit(benchmark::kMicrosecond);
BENCHMARK_REGISTER_F(Nets, energy_gradient_hessian)->Arg(10)->Arg(18)->Arg(32)->Arg(56)->Arg(100)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace debulk
