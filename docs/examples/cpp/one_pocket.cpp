// Will it crease or cease? One round pocket on a flat mold, from its heights to its verdict: one_pocket HEIGHT_MM
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include <debulk/core/error.hpp>
#include <debulk/fibre/excess_field.hpp>
#include <debulk/net/fibre_net.hpp>
#include <debulk/ridge/post_process.hpp>
#include <debulk/sheet/minimise.hpp>
#include <debulk/verdict/excess_bounds.hpp>
#include <debulk/verdict/judge.hpp>

namespace {

const double kPi = std::acos(-1.0);
constexpr double kRadiusMm = 30;

struct Plane : debulk::Surface {
  debulk::SurfaceSample sample(const Eigen::Vector2d&) const override { return {}; }
};

// The ply over the pocket, h cos^2(pi r / 2 R) high, flat outside it. Any other surface serves, for one a debulk::Reference
// of heights on a grid, as long as it has two derivatives.
class Bell : public debulk::Surface {
 public:
  explicit Bell(double height_mm) : height_(height_mm) {}
  debulk::SurfaceSample sample(const Eigen::Vector2d& p) const override {
    const double r = p.norm(), k = kPi / kRadiusMm;
    if (r >= kRadiusMm) return {};
    // h (1 + cos(k r)) / 2; its first derivative over r, and its second along r
    const double over_r = r > 1e-9 ? -height_ / 2 * k * std::sin(k * r) / r : -height_ / 2 * k * k;
    const double along_r = -height_ / 2 * k * k * std::cos(k * r);
    const Eigen::Vector2d e = r > 1e-9 ? Eigen::Vector2d(p / r) : Eigen::Vector2d(1, 0);
    const Eigen::Matrix2d radial = e * e.transpose();
    return {height_ / 2 * (1 + std::cos(k * r)), over_r * p, along_r * radial + over_r * (Eigen::Matrix2d::Identity() - radial)};
  }

 private:
  double height_;
};

}  // namespace

int main(int arguments, char** argument) try {
  using namespace debulk;
  const double height_mm = arguments > 1 ? std::strtod(argument[1], nullptr) : 4.0;
  const Bell ply(height_mm);
  const auto mold = std::make_shared<Plane>();
  const PlyMaterial material;  // the paper's

  PocketShape shape;
  shape.angles = {0, kPi / 2};
  for (int k = 0; k < 200; ++k) shape.outline.push_back(kRadiusMm * Eigen::Vector2d(std::cos(k * kPi / 100), std::sin(k * kPi / 100)));

  // By how much the fibres are too long for the mold: lines along them, read from heights as a scan gives them.
  const Criteria criteria;
  const Box box{{-2 * kRadiusMm, -2 * kRadiusMm}, {2 * kRadiusMm, 2 * kRadiusMm}};
  FibreOptions lines;
  Grid<float> heights(241, 241, box.low, 0.5, 0.0F);
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i) heights.at(i, j) = static_cast<float>(lines.thickness + ply.sample(heights.position(i, j)).height);
  const ExcessField field = measure_excess(straight_lines(shape.angles, {}, box, lines), heights, {}, *mold, true, lines);
  double excess = 0, least = 0, most = 0;
  for (const FibreRun& run : field.runs) {
    excess = std::max(excess, run.excess.mid);
    least = std::max(least, run.excess.low - run.uncertainty), most = std::max(most, run.excess.high + run.uncertainty);
  }
  const auto ridge = [&](double length) { return ridge_by_formula(length, material.thickness_mm, RidgeOptions().bulk_factor); };

  // The net, and the ply under vacuum, with a certificate, and what will be seen of it.
  const PocketNet net = fibre_net(ply, *mold, shape, FibreNetOptions());
  const Minimum minimum = best(minimise(Sheet(net.net, net.area, material, mold), MinimiseOptions()));
  const PostProcessed seen = post_process(minimum.nodes, net.net.neighbours, net.net.inside, *mold);

  PocketEvidence evidence;
  evidence.inside_ply = net.held_all_round();
  evidence.closed_rim = net.open_ends.empty();
  evidence.excess_ridge = Spread{ridge(least), ridge(most)};
  evidence.rms = {seen.rms, seen.rms};
  evidence.ridge_height = {seen.ridge_height, seen.ridge_height};
  evidence.bridge_height = {seen.bridge_height, seen.bridge_height};
  evidence.certified = minimum.certified();
  evidence.solve_status = name(minimum.status);
  const Judgement judgement = judge(evidence, criteria);

  std::printf("%zu nodes, %.2f mm apart; excess length %.3f mm; RMS %.3f mm; %s\n", net.net.nodes.size(), net.net.spacing, excess, seen.rms,
              minimum.certified() ? "certified" : "not certified");
  std::printf("%s: %s\n", name(judgement.verdict), judgement.reason.c_str());
  return 0;
} catch (const debulk::InputError& error) {
  std::fprintf(stderr, "one_pocket: %s\n", error.what());
  return 2;
}
