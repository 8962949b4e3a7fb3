// A stop ends the laying of a net soon, with Stopped, and the next one is not affected by it.
#include <gtest/gtest.h>

#include "debulk/net/lay_pocket.hpp"
#include "pocket/bells.hpp"

namespace debulk {
namespace {

// A bowl that raises the stop when it has been asked for so many heights.
struct Impatient : Surface {
  explicit Impatient(long most) : left(most) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    if (--left == 0) stop.cancel();
    return {p.squaredNorm() / 4000, p / 2000, Eigen::Matrix2d::Identity() / 2000};
  }
  mutable long left;
  Stop stop;
};

constexpr long kNever = 1000000000;

// lay(surface) -> PocketNet, stopped in many places: at most `late` more heights are asked for. Near the end it may also be
// done.
template <class Lay>
void stop_everywhere(const Lay& lay, long late) {
  const Impatient patient(kNever);
  const PocketNet whole = lay(patient);
  ASSERT_GT(whole.net.nodes.size(), 50u);
  const long asked = kNever - patient.left;
  const Impatient raised(kNever);
  raised.stop.cancel();
  EXPECT_THROW(lay(raised), Stopped);
  EXPECT_EQ(raised.left, kNever);  // nothing was asked for
  constexpr long places = 40;
  for (long k = 0; k < places; ++k) {
    const Impatient surface(1 + asked * k / places);
    if (k < places - 4) {
      EXPECT_THROW(lay(surface), Stopped) << k;
    } else {
      try {
        EXPECT_EQ(lay(surface).net.nodes, whole.net.nodes);
      } catch (const Stopped&) {
      }
    }
    EXPECT_LE(-surface.left, late) << k;
  }
  EXPECT_EQ(lay(Impatient(kNever)).net.nodes, whole.net.nodes);
}

TEST(FibreNet, EndsWhenStopped) {
  PocketShape shape;
  shape.angles = {0, kPi / 2};
  for (int k = 0; k < 200; ++k) shape.outline.emplace_back(50 * std::cos(2 * kPi * k / 200), 40 * std::sin(2 * kPi * k / 200));
  FibreNetOptions options;
  options.node_target = 1000;
  stop_everywhere([&](const Impatient& ply) { return fibre_net(ply, Impatient(kNever), shape, options, ply.stop); }, 11000);  // the area's
}

TEST(LayPocket, EndsWhenStopped) {
  const Segmentation segmentation = segment(sampled_bells({{{60, 60}, 8, 40, 40}}, 120, 120, 1.0, 0.3), {});
  const FootMap feet = find_feet(segmentation, {});
  stop_everywhere([&](const Impatient& mold) { return lay_pocket(segmentation, feet, 1, mold, {0, kPi / 2}, {}, {}, mold.stop); },
                  40000);  // the patch's
}

}  // namespace
}  // namespace debulk
