#include "debulk/sheet/minimise.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "debulk/core/error.hpp"
#include "debulk/sheet/certify.hpp"
#include "debulk/sheet/gap_problem.hpp"
#include "debulk/solve/method.hpp"

namespace debulk {
namespace {

// In each of the last kSofterRetries retries of a start, the fibres' stiffness is multiplied by kSofter, but not below
// kSoftest.
constexpr int kSofterRetries = 2;
constexpr double kSofter = 0.1, kSoftest = 1e6;

constexpr double kLevel = 1e-9;  // a slope up to this counts as level

// SplitMix64 (Steele, Lea, Flood 2014). It gives the same sequence on every machine, unlike the standard library's
// distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double between_minus_one_and_one() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return static_cast<double>(z >> 11) * 0x1.0p-52 - 1.0;
  }

 private:
  std::uint64_t state_;
};

// Moves the movable nodes by up to `amplitude` spacings along each gap coordinate, but not below the mold.
Eigen::VectorXd perturbed(Eigen::VectorXd y, double amplitude, Random& random) {
  for (long k = 0; k < y.size(); ++k) {
    y[k] += amplitude * random.between_minus_one_and_one();
    if (k % 3 == 2) y[k] = std::max(0.0, y[k]);
  }
  return y;
}

constexpr double kRetryPerturbation = 0.02;  // spacings
// The widest net for which the tolerance is as given. A barrier leaves force times gap, in spacings, so that on wider nets
// a node too high to count as touching would lean on the mold by half the certificate's limit and more.
constexpr double kWidest_mm = 20;

// Runs one start: solves and judges. If the point is a saddle, it continues from a point beside the saddle; if the
// solve failed, from a perturbed start; in the last retries with softer fibres (a compliance, for constraints that
// depend on each other). Returns the certified point, or else the last one.
Minimum run(const Sheet& sheet, const GapProblem& problem, const MinimiseOptions& options, const Eigen::VectorXd& start, Random& random) {
  const Method method_to_use = method(options.method);
  const double spacing = sheet.net().spacing;
  SolveOptions solve = options.solve;
  solve.tolerance *= std::min(1.0, kWidest_mm / spacing);
  Minimum minimum;
  Eigen::VectorXd next = start;
  for (int attempt = 0; attempt <= options.retries; ++attempt) {
    if (attempt > 0 && attempt > options.retries - kSofterRetries) solve.stiffness = std::max(kSoftest, kSofter * solve.stiffness);
    const Outcome outcome = method_to_use(problem, next, solve);
    minimum.iterations += outcome.iterations;
    minimum.evaluations += outcome.evaluations;
    const bool sound = outcome.y.allFinite();
    minimum.status = sound ? outcome.status : SolveStatus::numerical_failure;
    minimum.nodes = problem.to_points(sound ? outcome.y : next);
    const Judged judged = certify(sheet, minimum.nodes, solve.stiffness, solve.stop);
    if (!judged.complete) minimum.status = solve.stop.cancelled() ? SolveStatus::cancelled : SolveStatus::deadline;
    minimum.certificate = judged.certificate;
    minimum.tensions_n = judged.tensions_n;
    minimum.energy_mj = sheet.energy(minimum.nodes);
    // A compliance lets a method converge even where the fibres are too short to meet the constraints.
    const bool feasible = minimum.certificate.length_error <= Certificate::compliant_length_limit &&
                          minimum.certificate.penetration_mm <= Certificate::penetration_limit_mm;
    if (minimum.status == SolveStatus::converged && !feasible) minimum.status = SolveStatus::infeasible;
    if (minimum.certified() || minimum.status == SolveStatus::no_minimum || options.solve.stop.now()) break;
    if (!judged.descent.empty()) {
      Points beside = minimum.nodes;
      for (std::size_t i = 0; i < beside.size(); ++i) beside[i] += 0.05 * spacing * judged.descent[i];
      next = problem.from_points(beside);
      for (long k = 2; k < next.size(); k += 3) next[k] = std::max(0.0, next[k]);
    } else {
      next = perturbed(start, kRetryPerturbation, random);
    }
  }
  return minimum;
}

// A net without fixed nodes as a rigid ply that slides: all nodes are moved by the same (x, y) on the mold.
class Sliding {
 public:
  explicit Sliding(const Sheet& sheet) : sheet_(sheet), load_(std::accumulate(sheet.loads_n().begin(), sheet.loads_n().end(), 0.0)) {}

  // Whether the ply rests where it lies or comes to rest within its own size, and so firmly that a push by a spacing, or
  // as far as from its middle to its edge, does not set it off: the solve moves the nodes of a soft ply as far.
  bool held() const {
    if (load_ <= 0) return true;
    const double spacing = sheet_.net().spacing;
    Eigen::Vector2d slid = Eigen::Vector2d::Zero();
    if (!rest(slid)) return false;
    const double least = energy(slid) - kLevel * spacing - kRounding * sheet_.start().front().norm();
    for (const double push : {spacing, sheet_.size_mm() / 2})
      for (int k = 0; k < kPushes; ++k) {
        const double angle = 2 * EIGEN_PI * k / kPushes;
        if (energy(slid + push * Eigen::Vector2d(std::cos(angle), std::sin(angle))) < least) return false;
      }
    return true;
  }

 private:
  static constexpr int kPushes = 16;
  static constexpr double kRounding = 1e-15;  // of the mold's height, over its place

  double grip() const { return sheet_.grip_n() / load_; }
  // The mean height of the mold below the nodes and the work of friction, over the load.
  double energy(const Eigen::Vector2d& slid) const {
    double sum = grip() * slid.norm();
    for (std::size_t i = 0; i < sheet_.start().size(); ++i)
      sum += sheet_.loads_n()[i] / load_ * (sheet_.mold().height(sheet_.start()[i].head<2>() + slid) - sheet_.start()[i].z());
    return sum;
  }
  // Follows the energy downhill by Newton's method with steps of at most a spacing; returns whether that ends.
  bool rest(Eigen::Vector2d& slid) const {
    const Points& nodes = sheet_.start();
    const double spacing = sheet_.net().spacing;
    for (int step = 0; step < 300 && slid.norm() < sheet_.size_mm(); ++step) {
      Eigen::Vector2d slope = Eigen::Vector2d::Zero();
      Eigen::Matrix2d curvature = Eigen::Matrix2d::Zero();
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const SurfaceSample mold = sheet_.mold().sample(nodes[i].head<2>() + slid);
        slope += sheet_.loads_n()[i] / load_ * mold.gradient;
        curvature += sheet_.loads_n()[i] / load_ * mold.hessian;
      }
      const double way = slid.norm(), resting = grip() * std::sqrt(1 + slope.squaredNorm());
      if (slope.norm() <= std::max(step == 0 ? resting : 0.0, kLevel)) return true;
      if (step > 0) {
        const Eigen::Vector2d along = slid / way;
        slope += resting * along;
        curvature += resting / way * (Eigen::Matrix2d::Identity() - along * along.transpose());
        if (slope.norm() <= kLevel) return true;
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(curvature);
      Eigen::Vector2d move = axes.eigenvectors().transpose() * -slope;
      for (int a = 0; a < 2; ++a) move[a] /= std::max(std::abs(axes.eigenvalues()[a]), 1e-12);
      slid += axes.eigenvectors() * move * std::min(1.0, spacing / move.norm());
    }
    return false;
  }

  const Sheet& sheet_;
  double load_;
};

// Returns why the sheet cannot be solved, if that is known before trying; else `converged`.
SolveStatus refusal(const Sheet& sheet) {
  const Net& net = sheet.net();
  if (sheet.movable().empty()) return SolveStatus::nothing_moves;
  for (const double length : sheet.lengths(sheet.start()))
    if (std::abs(length / net.spacing - 1) > 0.5) return SolveStatus::not_a_surface;
  std::size_t equations = 0;
  for (const auto& [i, j] : sheet.segments())
    equations += net.kinds[static_cast<std::size_t>(i)] != NodeKind::fixed || net.kinds[static_cast<std::size_t>(j)] != NodeKind::fixed;
  if (equations > 3 * sheet.movable().size()) return SolveStatus::too_few_movable_nodes;
  // A force as large as the whole load would pass for none.
  if (Certificate::kkt_limit * sheet.force_unit_n() > sheet.strict_force_n()) return SolveStatus::too_stiff;
  const bool loose = sheet.movable().size() == sheet.start().size();
  return !loose || Sliding(sheet).held() ? SolveStatus::converged : SolveStatus::no_minimum;
}

// Whether no solve was tried, or a solve showed that there is no minimum. Then every other start would end in the same
// way.
bool ends_every_start(SolveStatus status) {
  return status == SolveStatus::nothing_moves || status == SolveStatus::too_few_movable_nodes || status == SolveStatus::no_minimum ||
         status == SolveStatus::not_a_surface || status == SolveStatus::too_stiff;
}

}  // namespace

void MinimiseOptions::check() const {
  (void)debulk::method(method);
  solve.check();
  require(starts >= 1, "starts", "1 or more", starts);
  require(first_start >= 0 && first_start < starts, "first_start", "0 to the number of starts less one", first_start);
  require(std::isfinite(perturbation) && perturbation >= 0 && perturbation < 1, "perturbation", "a share of the spacing in [0, 1)",
          perturbation);
  require(retries >= 0, "retries", "0 or more", retries);
}

Minimiser::Minimiser(std::shared_ptr<const Sheet> sheet) : sheet_(std::move(sheet)), refusal_(refusal(*sheet_)) {
  if (refusal_ != SolveStatus::converged) return;
  const Eigen::Vector3d origin = sheet_->start().front();
  near_origin_ = origin.isZero(0) ? sheet_ : std::make_shared<const Sheet>(sheet_->moved(-origin));
}

Minimum Minimiser::not_tried(SolveStatus status, const SolveOptions& options) const {
  Minimum out;
  out.nodes = sheet_->start();
  out.status = status;
  out.certificate = certify(*sheet_, out.nodes, options.stiffness, options.stop).certificate;
  out.energy_mj = sheet_->energy(out.nodes);
  return out;
}

// Runs start k: 0 is the given one (or the sheet's), the others are seeded perturbations of it. Far from the origin,
// differences of coordinates have too few digits for stiff fibres, so the solve is made near the origin. The
// certificate holds for the configuration there; the returned nodes are that configuration moved back, with rounding.
Minimum Minimiser::from_start(const MinimiseOptions& options, const Points* start, int k) const {
  if (refusal_ != SolveStatus::converged) return not_tried(refusal_, options.solve);
  const Points& given = start ? *start : sheet_->start();
  if (options.solve.stop.now()) {
    Minimum minimum = not_tried(options.solve.stop.cancelled() ? SolveStatus::cancelled : SolveStatus::deadline, options.solve);
    minimum.nodes = given;
    return minimum;
  }
  const Eigen::Vector3d origin = sheet_->start().front();
  Points near_start = given;
  for (Eigen::Vector3d& node : near_start) node -= origin;
  const GapProblem problem(*near_origin_);
  const Eigen::VectorXd first = problem.from_points(near_start);
  Random random(options.seed * 1000003u + static_cast<std::uint64_t>(k));
  Minimum minimum = debulk::run(*near_origin_, problem, options, k == 0 ? first : perturbed(first, options.perturbation, random), random);
  for (Eigen::Vector3d& node : minimum.nodes) node += origin;
  for (std::size_t i = 0; i < minimum.nodes.size(); ++i)
    if (sheet_->net().kinds[i] == NodeKind::fixed) minimum.nodes[i] = sheet_->start()[i];
  return minimum;
}

std::vector<Minimum> Minimiser::run(const MinimiseOptions& options, const Points* start) const {
  options.check();
  if (start) sheet_->energy(*start);  // throws InputError if the start is not valid
  std::vector<Minimum> minima;
  for (int k = options.first_start; k < options.starts; ++k) {
    if (!minima.empty() && (options.solve.stop.now() || ends_every_start(minima[0].status))) break;
    minima.push_back(from_start(options, start, k));
  }
  return minima;
}

std::vector<Minimum> minimise(const Sheet& sheet, const MinimiseOptions& options, const Points* start) {
  return Minimiser(std::shared_ptr<const Sheet>(std::shared_ptr<void>(), &sheet))
      .run(options, start);  // the pointer does not own the sheet
}

const Minimum& best(const std::vector<Minimum>& minima) {
  // Strained fibres reduce the energy, so a compliant minimum is the best only if there is no other.
  const auto rank = [](const Minimum& m) { return std::tuple(!m.certified(), m.certificate.compliant, m.energy_mj); };
  const Minimum* found = &minima.front();
  for (const Minimum& m : minima)
    if (m.certified() && rank(m) < rank(*found)) found = &m;
  return *found;
}

}  // namespace debulk
