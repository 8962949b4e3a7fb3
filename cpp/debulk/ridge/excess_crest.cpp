#include "debulk/ridge/excess_crest.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "debulk/core/error.hpp"
#include "debulk/ridge/mold_length.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;

constexpr double kStep = 0.5;  // of the curve, in node spacings
// The curve ends where the fold is half as high; the height of an elastic fold varies as its excess to the power of
// 4/7.
constexpr double kEndPower = -7.0 / 4;
// Below this correlation of the fibres' coordinates over the pocket, the pocket is equally long along both diagonals of
// its fibres and may fold along either. The 45 pockets of the referee (the independent solver) above it all fold along
// the longer one (bench/referee/crests.txt).
constexpr double kDiagonal = 0.15;

// The excess of the fibres of one direction, mm, by their place in the lattice, from the first on.
struct Held {
  int first = 0;
  std::vector<double> excess;

  // Interpolates between the fibres; 0 beyond them.
  double at(double place) const {
    const double from = place - first, k = std::floor(from);
    const auto of = [this](double i) {
      return i >= 0 && i < static_cast<double>(excess.size()) ? excess[static_cast<std::size_t>(i)] : 0.0;
    };
    return (1 - (from - k)) * of(k) + (from - k) * of(k + 1);
  }
};

struct HeldFibres {
  std::array<Held, 2> by_direction;
  std::vector<int> worst;  // nodes of the fibre with the largest excess; empty if none has any
};

HeldFibres held_fibres(const Net& laid, const Surface& mold) {
  HeldFibres out;
  std::array<std::map<int, double>, 2> spare;
  double most = 0;
  for (const std::vector<int>& fibre : fibres(laid.neighbours)) {
    const auto first = static_cast<std::size_t>(fibre.front()), last = static_cast<std::size_t>(fibre.back());
    if (laid.kinds[first] != NodeKind::fixed || laid.kinds[last] != NodeKind::fixed) continue;
    const std::size_t direction = laid.neighbours[first][east] == fibre[1] ? 0 : 1;
    std::vector<Eigen::Vector3d> ply;
    for (const int node : fibre) ply.push_back(laid.nodes[static_cast<std::size_t>(node)]);
    const double excess = std::max(0.0, fibre_excess(ply, mold));
    double& known = spare[direction][laid.lattice[first][1 - direction]];
    known = std::max(known, excess);
    if (excess > most) most = excess, out.worst = fibre;
  }
  for (std::size_t direction = 0; direction < 2; ++direction) {
    if (spare[direction].empty()) continue;
    Held& held = out.by_direction[direction];
    held.first = spare[direction].begin()->first;
    held.excess.assign(static_cast<std::size_t>(spare[direction].rbegin()->first - held.first + 1), 0.0);
    for (const auto& [number, excess] : spare[direction]) held.excess[static_cast<std::size_t>(number - held.first)] = excess;
  }
  return out;
}

// Returns the correlation of the fibres' coordinates, weighted by the gap below the ply: 1 for a pocket along their
// first diagonal.
double lean(const Net& laid, const std::vector<double>& gaps) {
  double sum = 0, xx = 0, xy = 0, yy = 0;
  Vector2d mean = Vector2d::Zero();
  const auto place = [&](std::size_t n) { return Vector2d(laid.lattice[n][0], laid.lattice[n][1]); };
  for (std::size_t n = 0; n < gaps.size(); ++n) {
    sum += std::max(gaps[n], 0.0);
    mean += std::max(gaps[n], 0.0) * place(n);
  }
  if (!(sum > 0)) return 0;
  mean /= sum;
  for (std::size_t n = 0; n < gaps.size(); ++n) {
    const Vector2d off = place(n) - mean;
    const double weight = std::max(gaps[n], 0.0);
    xx += weight * off.x() * off.x(), xy += weight * off.x() * off.y(), yy += weight * off.y() * off.y();
  }
  return xx * yy > 0 ? xy / std::sqrt(xx * yy) : 0.0;
}

// Points of the laid ply between the nodes of its lattice, mold XY.
class Places {
 public:
  explicit Places(const Net& laid) : laid_(laid) {
    for (std::size_t n = 0; n < laid.lattice.size(); ++n) numbers_[laid.lattice[n]] = n;
  }

  // Interpolates in the cell of four nodes; returns nullopt outside the net.
  std::optional<Vector2d> at(const Vector2d& place) const {
    const Vector2d low = place.array().floor(), part = place - low;
    Vector2d out = Vector2d::Zero();
    for (const int dj : {0, 1})
      for (const int di : {0, 1}) {
        const double share = (di == 1 ? part.x() : 1 - part.x()) * (dj == 1 ? part.y() : 1 - part.y());
        if (!(share > 0)) continue;
        const auto found = numbers_.find({static_cast<int>(low.x()) + di, static_cast<int>(low.y()) + dj});
        if (found == numbers_.end()) return std::nullopt;
        out += share * laid_.nodes[found->second].head<2>();
      }
    return out;
  }

 private:
  const Net& laid_;
  std::map<std::array<int, 2>, std::size_t> numbers_;
};

// Follows the crest both ways to where the fold is half as high or the net ends. sign: the side of the first fibre on
// which the crest's normal lies.
std::vector<Vector2d> curve(const std::array<Held, 2>& held, const Places& places, const Vector2d& start, double sign) {
  const auto whole = [&](const Vector2d& at) { return std::hypot(held[0].at(at.y()), held[1].at(at.x())); };
  const auto along = [&](const Vector2d& at) -> Vector2d {
    const double size = whole(at);
    return size > 0 ? Vector2d(sign * held[1].at(at.x()), held[0].at(at.y())) / size : Vector2d(0, 0);
  };
  const double least = std::exp2(kEndPower) * whole(start);
  const std::size_t longest = 4 * (held[0].excess.size() + held[1].excess.size());
  std::vector<Vector2d> out;
  for (const double step : {-kStep, kStep}) {
    if (step > 0) std::reverse(out.begin(), out.end());
    if (const auto first = places.at(start); first && step > 0) out.push_back(*first);
    Vector2d at = start;
    for (std::size_t k = 1; k < longest; ++k) {
      at += step * along(at + step / 2 * along(at));
      const std::optional<Vector2d> point = places.at(at);
      if (!point || whole(at) < least) break;
      out.push_back(*point);
    }
  }
  return out;
}

}  // namespace

std::optional<ExcessCrest> excess_crest(const Net& laid, const Surface& mold) {
  require(laid.lattice.size() == laid.nodes.size(), "net", "a net with the lattice on which it was laid", "none");
  const HeldFibres held = held_fibres(laid, mold);
  if (held.worst.empty()) return std::nullopt;
  std::vector<double> gaps;
  gaps.reserve(laid.nodes.size());
  for (const Eigen::Vector3d& node : laid.nodes) gaps.push_back(node.z() - mold.height(node.head<2>()));
  const auto lower = [&](int a, int b) { return gaps[static_cast<std::size_t>(a)] < gaps[static_cast<std::size_t>(b)]; };
  ExcessCrest out;
  out.peak = *std::max_element(held.worst.begin(), held.worst.end(), lower);
  const auto& [i, j] = laid.lattice[static_cast<std::size_t>(out.peak)];
  const Vector2d start(i, j);
  const double leaning = lean(laid, gaps), sign = leaning >= 0 ? 1 : -1;
  const Places places(laid);
  out.line = curve(held.by_direction, places, start, sign);
  if (std::abs(leaning) < kDiagonal) out.mirrored = curve(held.by_direction, places, start, -sign);
  return out;
}

}  // namespace debulk
