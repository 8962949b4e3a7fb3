#include "debulk/sheet/minimise.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "debulk/core/parallel.hpp"
#include "sheet/nets.hpp"

namespace debulk::minimise_test {
namespace {

constexpr double kSpacing = 5.0;
using test::Impatient;
using test::ridge_net;

Sheet ridge(double angle, const PlyMaterial& ply = PlyMaterial()) {
  return Sheet(ridge_net(9, 7, angle), 900.0, ply, std::make_shared<test::Plane>());
}

TEST(Minimiser, GivesTheSameBitsOnAnyNumberOfThreads) {
  constexpr int kStarts = 4;
  for (const double angle : {0.1, 0.5, 0.9}) {
    const auto sheet = std::make_shared<const Sheet>(ridge(angle).moved({300, -200, 800}));
    MinimiseOptions options;
    options.starts = kStarts;
    const std::vector<Minimum> alone = minimise(*sheet, options);
    ASSERT_EQ(alone.size(), std::size_t{kStarts});
    for (const int threads : {1, 2, 4}) {
      const Minimiser together(sheet);
      std::vector<Minimum> minima(kStarts);
      parallel_for(kStarts, 1, threads, [&](long k, long) {
        MinimiseOptions one = options;
        one.first_start = static_cast<int>(k), one.starts = one.first_start + 1;
        minima[static_cast<std::size_t>(k)] = together.run(one).at(0);
      });
      for (std::size_t k = 0; k < kStarts; ++k) {
        EXPECT_EQ(minima[k].nodes, alone[k].nodes);
        EXPECT_EQ(minima[k].iterations, alone[k].iterations);
        EXPECT_TRUE(alone[k].certified()) << alone[k].certificate.failure();
      }
    }
  }
}

TEST(Minimise, StopsWithinAnIterationAndSaysSo) {
  for (const char* name : {"interior_point", "ipopt", "nlopt"})
    for (const long most : {80L, 200L, 300L}) {
      const auto mold = std::make_shared<Impatient>(most);
      const Sheet sheet(ridge_net(9, 7, 0.5), 900.0, PlyMaterial(), mold);
      MinimiseOptions options;
      options.method = name;
      options.starts = 3;
      options.solve.stop = mold->stop;
      const std::vector<Minimum> minima = minimise(sheet, options);
      EXPECT_EQ(minima.size(), 1u) << name;
      EXPECT_EQ(minima[0].status, SolveStatus::cancelled) << name;
      EXPECT_FALSE(minima[0].certified()) << name;
      for (const Eigen::Vector3d& p : minima[0].nodes) EXPECT_TRUE(p.allFinite());
    }
}

TEST(Minimise, ReturnsTheStartWhereTheStopIsRaisedAlready) {
  const Sheet sheet = ridge(0.5);
  for (const char* name : {"interior_point", "ipopt", "nlopt"})
    for (const bool cancelled : {true, false}) {
      MinimiseOptions options;
      options.method = name;
      options.starts = 3;
      if (cancelled)
        options.solve.stop.cancel();
      else
        options.solve.stop.set_deadline(-1);
      const std::vector<Minimum> minima = minimise(sheet, options);
      ASSERT_EQ(minima.size(), 1u);
      EXPECT_EQ(minima[0].status, cancelled ? SolveStatus::cancelled : SolveStatus::deadline);
      EXPECT_EQ(minima[0].nodes, sheet.start());
      EXPECT_EQ(minima[0].evaluations, 0);
      EXPECT_FALSE(minima[0].certified());
    }
}

// Wherever it is raised, also while a point is judged: nothing is called certified whose certificate was cut short.
TEST(Minimise, SaysSoWhereverItIsStopped) {
  const auto whole = std::make_shared<Impatient>(1L << 40);
  const Minimum minimum = minimise(Sheet(ridge_net(9, 7, 0.5), 900.0, PlyMaterial(), whole), MinimiseOptions())[0];
  ASSERT_TRUE(minimum.certified());
  const long samples = (1L << 40) - whole->left;
  for (long most = samples - 200; most <= samples; most += 8) {
    const auto mold = std::make_shared<Impatient>(most);
    MinimiseOptions options;
    options.solve.stop = mold->stop;
    const Minimum stopped = minimise(Sheet(ridge_net(9, 7, 0.5), 900.0, PlyMaterial(), mold), options)[0];
    if (stopped.status == SolveStatus::converged)
      EXPECT_EQ(stopped.certificate.kkt_error, minimum.certificate.kkt_error);
    else
      EXPECT_EQ(stopped.status, SolveStatus::cancelled);
    EXPECT_EQ(stopped.certified(), stopped.status == SolveStatus::converged);
  }
}

TEST(Minimise, KeepsWhatWasCertifiedBeforeTheStop) {
  const Sheet quick = ridge(0.5);
  const Minimum whole = minimise(quick, MinimiseOptions())[0];
  ASSERT_TRUE(whole.certified());
  // The first start ends; the flag goes up during a later one.
  const auto mold = std::make_shared<Impatient>(static_cast<long>(quick.movable().size()) * (whole.evaluations + 12));
  const Sheet sheet(ridge_net(9, 7, 0.5), 900.0, PlyMaterial(), mold);
  MinimiseOptions options;
  options.starts = 1000;
  options.solve.stop = mold->stop;
  const std::vector<Minimum> minima = minimise(sheet, options);
  EXPECT_LT(minima.size(), 10u);
  EXPECT_TRUE(best(minima).certified());
  EXPECT_LE(best(minima).energy_mj, whole.energy_mj + 1e-9);
}

TEST(Minimise, RefusesWhatCannotBeSolvedUpFront) {
  Net held = ridge_net(9, 7, 0.5);
  int movable = 0;
  for (NodeKind& kind : held.kinds)
    if (kind == NodeKind::inner && ++movable > 2) kind = NodeKind::fixed;
  const auto status = [](const Net& net, const PlyMaterial& ply = PlyMaterial(), double slope = 0) {
    const Sheet sheet(net, 900.0, ply, std::make_shared<test::Plane>(slope, 0));
    const std::vector<Minimum> minima = minimise(sheet, MinimiseOptions());
    EXPECT_EQ(minima.size(), 1u);
    EXPECT_EQ(minima[0].iterations, 0);
    return minima[0].status;
  };
  EXPECT_EQ(status(held), SolveStatus::too_few_movable_nodes);

  Net free = test::flat_net(9, 7, kSpacing, false);
  for (std::size_t i = 0; i < free.nodes.size(); ++i) free.kinds[i] = NodeKind::free;
  PlyMaterial slippery;
  slippery.friction = 0;
  EXPECT_EQ(status(free, slippery, 0.01), SolveStatus::no_minimum);
  EXPECT_EQ(status(free, PlyMaterial(), 0.5), SolveStatus::no_minimum);  // steeper than its friction of 0.4
  PlyMaterial unpressed;                                                 // no vacuum, no grip: its weight is enough
  unpressed.pressure_mpa = 0;
  EXPECT_EQ(status(free, unpressed, 0.01), SolveStatus::no_minimum);

  Net twice = ridge_net(9, 7, 0.5);
  twice.nodes[20] = twice.nodes[21];
  EXPECT_EQ(status(twice), SolveStatus::not_a_surface);
}

TEST(Minimise, AFreePlyIsSolvedWhereSomethingHoldsIt) {
  Net free = test::flat_net(7, 7, kSpacing, false);
  for (NodeKind& kind : free.kinds) kind = NodeKind::free;
  PlyMaterial slippery;
  slippery.friction = 0;
  const auto ended = [&](std::shared_ptr<const Surface> mold, const PlyMaterial& ply, double narrow = 1) {
    Net net = free;
    for (Eigen::Vector3d& p : net.nodes) {
      p.x() *= narrow;
      p.z() = mold->height(p.head<2>());
    }
    const Minimum minimum = minimise(Sheet(net, 900.0, ply, mold), MinimiseOptions())[0];
    return minimum.status == SolveStatus::no_minimum || minimum.certified() ? name(minimum.status) : minimum.certificate.failure();
  };
  EXPECT_EQ(ended(std::make_shared<test::Plane>(), slippery), "converged");
  EXPECT_EQ(ended(std::make_shared<test::Plane>(0.1, 0), PlyMaterial(), 1 / std::sqrt(1.01)), "converged");
  // A trough whose bottom is beside the net: it slides there. A hill: it slides off.
  EXPECT_EQ(ended(std::make_shared<test::Quadric>(0.002, 0, 0.002), slippery), "converged");
  EXPECT_EQ(ended(std::make_shared<test::Quadric>(-0.002, 0, -0.002), slippery), "no_minimum");
  // On top of a round bar friction holds it, but so little that a push by a spacing sets it off.
  PlyMaterial smooth;
  smooth.friction = 1e-3;
  EXPECT_EQ(ended(std::make_shared<test::Quadric>(-0.004, 0, 0), smooth), "no_minimum");
}

// Half of the edge is free, and the mold falls away below it: a long way to go for a ply without stiffness.
TEST(Minimise, AnUnstiffPlyGoesALongWay) {
  Net net = test::flat_net(13, 13, kSpacing);
  PlyMaterial ply;
  ply.young_mpa = ply.shear_mpa = 0.01;
  ply.friction = 0.05;
  const auto mold = std::make_shared<test::Plane>(0.75, 0);
  for (std::size_t i = 0; i < net.nodes.size(); ++i) {
    if (net.kinds[i] == NodeKind::fixed && net.nodes[i].y() < 45) net.kinds[i] = NodeKind::free;
    net.nodes[i].x() *= 0.8;
    net.nodes[i].z() = mold->height(net.nodes[i].head<2>());
  }
  const std::vector<Minimum> minima = minimise(Sheet(net, 3600.0, ply, mold), MinimiseOptions());
  EXPECT_TRUE(minima[0].certified()) << name(minima[0].status) << ' ' << minima[0].certificate.failure();
  EXPECT_LT(minima[0].energy_mj, -1000);
}

TEST(Minimise, FibresPinnedAtBothEndsAtTheirChordAreSolved) {
  const Sheet sheet(test::flat_net(9, 9, kSpacing), 1000.0, PlyMaterial(), std::make_shared<test::Plane>());
  const std::vector<Minimum> minima = minimise(sheet, MinimiseOptions());
  EXPECT_TRUE(minima[0].certified()) << minima[0].certificate.failure();
  EXPECT_LE(minima[0].certificate.length_error, 1e-3);
}

// On a wide net what a barrier leaves of a force acts at a node that is too high to count as touching.
TEST(Minimise, AWideNetIsSolvedToTheCertificatesLimit) {
  Net net = test::ridge_net(9, 7, 0.5);
  for (Eigen::Vector3d& p : net.nodes) p *= 20;
  net.spacing *= 20;
  const Minimum minimum = minimise(Sheet(net, 900.0 * 400, PlyMaterial(), std::make_shared<test::Plane>()), MinimiseOptions())[0];
  EXPECT_TRUE(minimum.certified()) << minimum.certificate.failure();
  EXPECT_LE(minimum.certificate.kkt_error, 0.5 * Certificate::kkt_limit);
}

TEST(Minimise, AStiffPlyThatHardlyFeelsTheVacuumIsCertified) {
  PlyMaterial stiff;
  stiff.young_mpa = 3.6e6;
  stiff.shear_mpa = 4e5;
  stiff.pressure_mpa = 1e-3;
  const std::vector<Minimum> minima = minimise(ridge(0.5, stiff), MinimiseOptions());
  EXPECT_TRUE(minima[0].certified()) << name(minima[0].status) << minima[0].certificate.failure();
}

TEST(Minimise, GoesOnFromALaterStart) {
  const Sheet sheet = ridge(0.5);
  MinimiseOptions options;
  options.starts = 4;
  const auto all = minimise(sheet, options);
  options.first_start = 2;
  const auto later = minimise(sheet, options);
  ASSERT_EQ(all.size(), 4u);
  ASSERT_EQ(later.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(later[k].nodes, all[k + 2].nodes);
  options.first_start = 4;
  EXPECT_THROW(minimise(sheet, options), InputError);
}

TEST(Best, IsOneWithoutAComplianceIfThereIsAny) {
  const auto minimum = [](SolveStatus status, double energy, double length_error) {
    Minimum m;
    m.status = status;
    m.energy_mj = energy;
    m.certificate.length_error = length_error;
    m.certificate.compliant = length_error > 1e-4;
    return m;
  };
  const Minimum good = minimum(SolveStatus::converged, -5, 0), better = minimum(SolveStatus::converged, -6, 0);
  const Minimum strained = minimum(SolveStatus::converged, -9, 5e-4), failed = minimum(SolveStatus::iteration_limit, -99, 0);
  ASSERT_TRUE(strained.certified());
  const auto energy_of_best = [](const std::vector<Minimum>& minima) { return best(minima).energy_mj; };
  EXPECT_EQ(energy_of_best({good, better, strained}), -6);
  EXPECT_EQ(energy_of_best({strained, good}), -5);
  EXPECT_EQ(energy_of_best({failed, strained}), -9);
  EXPECT_EQ(energy_of_best({failed}), -99);
}

}  // namespace
}  // namespace debulk::minimise_test
