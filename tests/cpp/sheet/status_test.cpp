// Every way in which a minimisation may end, each provoked by a net, and the list of them complete.
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "debulk/sheet/minimise.hpp"
#include "sheet/nets.hpp"

namespace debulk {
namespace {

constexpr double kArea = 900.0;

std::shared_ptr<const Surface> plane(double slope = 0) {
  return std::make_shared<test::Plane>(slope, 0);
}

Minimum ridge(const MinimiseOptions& options, std::shared_ptr<const Surface> mold = plane()) {
  return minimise(Sheet(test::ridge_net(9, 7, 0.5), kArea, PlyMaterial(), mold), options)[0];
}

// A mold that takes its time, so that a deadline passes during the solve on any machine.
struct Slow : test::Plane {
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Plane::sample(p);
  }
};

Minimum converged() {
  return ridge(MinimiseOptions());
}

Minimum nothing_moves() {
  return minimise(Sheet(test::flat_net(3, 2, 5.0), kArea, PlyMaterial(), plane()), MinimiseOptions())[0];
}

Minimum iteration_limit() {
  MinimiseOptions options;
  options.solve.max_iterations = 3;
  return ridge(options);
}

Minimum deadline() {
  MinimiseOptions options;
  options.solve.stop.set_deadline(0.5);
  return ridge(options, std::make_shared<Slow>());
}

Minimum cancelled() {
  const auto mold = std::make_shared<test::Impatient>(400);
  MinimiseOptions options;
  options.solve.stop = mold->stop;
  return ridge(options, mold);
}

// Fixed nodes further apart than the fibres between them are long.
Minimum infeasible(const char* method, double stretch) {
  Net net = test::flat_net(9, 7, 5.0);
  for (Eigen::Vector3d& p : net.nodes) p.x() *= stretch;
  MinimiseOptions options;
  options.method = method;
  return minimise(Sheet(net, kArea, PlyMaterial(), plane()), options)[0];
}

// More digits than there are.
Minimum numerical_failure(const char* method) {
  MinimiseOptions options;
  options.method = method;
  options.solve.tolerance = 1e-18;
  options.retries = 0;
  return ridge(options);
}

Minimum too_few_movable_nodes() {
  Net net = test::flat_net(9, 7, 5.0);
  for (std::size_t i = 0; i < net.kinds.size(); ++i) net.kinds[i] = i == 30 ? NodeKind::inner : NodeKind::fixed;
  return minimise(Sheet(net, kArea, PlyMaterial(), plane()), MinimiseOptions())[0];
}

// On a slope without friction, two pieces: one held by its border, and one that nothing holds. `held` alone is refused up front
// where it is false.
Minimum no_minimum(bool held) {
  constexpr double slope = 0.5;
  Net net = test::flat_net(4, 4, 5.0, held);
  const Net loose = test::flat_net(3, 3, 5.0, false);
  const int first = static_cast<int>(net.nodes.size());
  for (std::size_t i = 0; i < loose.nodes.size(); ++i) {
    net.nodes.push_back(loose.nodes[i] + Eigen::Vector3d(100, 0, 0));
    net.neighbours.push_back(loose.neighbours[i]);
    for (int& neighbour : net.neighbours.back())
      if (neighbour >= 0) neighbour += first;
    net.kinds.push_back(NodeKind::free);
    net.inside.push_back(1);
  }
  for (Eigen::Vector3d& p : net.nodes) p = {p.x() / std::sqrt(1 + slope * slope), p.y(), p.x() / std::sqrt(1 + slope * slope) * slope};
  PlyMaterial slippery;
  slippery.friction = 0;
  return minimise(Sheet(net, kArea, slippery, plane(slope)), MinimiseOptions())[0];
}

Minimum not_a_surface() {
  Net net = test::ridge_net(9, 7, 0.5);
  net.nodes[20] = net.nodes[21];
  return minimise(Sheet(net, kArea, PlyMaterial(), plane()), MinimiseOptions())[0];
}

// A plate on which the vacuum is lost.
Minimum too_stiff() {
  PlyMaterial plate;
  plate.young_mpa = 1e9;
  plate.pressure_mpa = 1e-4;
  return minimise(Sheet(test::ridge_net(9, 7, 0.5), kArea, plate, plane()), MinimiseOptions())[0];
}

TEST(Status, OfEveryKindIsReached) {
  const std::map<SolveStatus, std::vector<Minimum>> ways = {
      {SolveStatus::converged, {converged()}},
      {SolveStatus::nothing_moves, {nothing_moves()}},
      {SolveStatus::iteration_limit, {iteration_limit()}},
      {SolveStatus::deadline, {deadline()}},
      {SolveStatus::cancelled, {cancelled()}},
      {SolveStatus::infeasible, {infeasible("interior_point", 1.002), infeasible("ipopt", 1.05), infeasible("nlopt", 1.25)}},
      {SolveStatus::numerical_failure, {numerical_failure("interior_point"), numerical_failure("ipopt")}},
      {SolveStatus::too_few_movable_nodes, {too_few_movable_nodes()}},
      {SolveStatus::no_minimum, {no_minimum(false), no_minimum(true)}},
      {SolveStatus::not_a_surface, {not_a_surface()}},
      {SolveStatus::too_stiff, {too_stiff()}},
  };
  const std::set<SolveStatus> up_front = {SolveStatus::nothing_moves, SolveStatus::too_few_movable_nodes, SolveStatus::not_a_surface,
                                          SolveStatus::too_stiff};
  std::set<std::string> names, explanations;
  for (const auto& [status, minima] : ways)
    for (const Minimum& minimum : minima) {
      EXPECT_EQ(name(minimum.status), std::string(name(status)));
      EXPECT_EQ(minimum.certified(), status == SolveStatus::converged || status == SolveStatus::nothing_moves) << name(status);
      EXPECT_EQ(minimum.iterations == 0, up_front.count(status) || &minimum == &ways.at(SolveStatus::no_minimum)[0]) << name(status);
      for (const Eigen::Vector3d& p : minimum.nodes) EXPECT_TRUE(p.allFinite()) << name(status);
      names.insert(name(status));
      explanations.insert(explanation(status));
    }
  // Values are numbered from 0: the first without a name is the end of the list.
  int known = 0;
  while (name(static_cast<SolveStatus>(known)) != std::string("unknown")) ++known;
  EXPECT_EQ(ways.size(), static_cast<std::size_t>(known));
  EXPECT_EQ(names.size(), ways.size());
  EXPECT_EQ(explanations.size(), ways.size());
  EXPECT_STREQ(explanation(static_cast<SolveStatus>(known)), "unknown");
}

// What it says is what the certificate found: fibres drawn out by as much as their ends are apart.
TEST(Status, InfeasibleIsALengthThatCannotBeKept) {
  for (const char* method : {"interior_point", "ipopt", "nlopt"}) {
    const Minimum taut = infeasible(method, 1.02);
    EXPECT_EQ(taut.status, SolveStatus::infeasible) << method;
    EXPECT_NEAR(taut.certificate.length_error, 0.02, 1e-3) << method;
  }
  // And not one that could not be brought to the last digit.
  const Minimum rounded = numerical_failure("ipopt");
  EXPECT_LT(rounded.certificate.length_error, Certificate::length_limit);
}

}  // namespace
}  // namespace debulk
