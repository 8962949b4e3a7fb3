// A scanner that writes its next scan into the memory of the one that is worked on: heights may be of either, and nothing
// else happens. Indices that are computed twice from such points would crash, or be seen by the address sanitizer.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "debulk/surface/front_end.hpp"
#include "looking_down.hpp"

namespace debulk::changing_scan_test {
namespace {

constexpr int width = 160, height = 100, rounds = 50;

std::vector<float> hill() {
  const View view = looking_down(width, height);
  std::vector<float> points;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const double r = std::hypot(i - 75.0, j - 45.0), z = 500 - (r < 35 ? 4 * (1 + std::cos(std::acos(-1.0) * r / 35)) : 0);
      for (const double v : {view.camera.u(i) * z, view.camera.v(j) * z, z}) points.push_back(static_cast<float>(v));
    }
  return points;
}

// Writes block after block of what a scanner, or anybody, may leave in memory, and the scan itself.
class Scribbler {
 public:
  Scribbler(std::vector<float>& scan, const std::vector<float>& original) : writer_([this, &scan, &original] { write(scan, original); }) {}
  ~Scribbler() {
    end_ = true;
    writer_.join();
  }
  Scribbler(const Scribbler&) = delete;
  Scribbler& operator=(const Scribbler&) = delete;

 private:
  void write(std::vector<float>& scan, const std::vector<float>& original) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const std::vector<float> values{NAN, infinity, -infinity, 1e30f, -1e30f, 0.0f, 3e38f, 500.0f, -500.0f};
    std::mt19937 random(5);
    for (std::size_t k = 0; !end_; ++k) {
      const std::size_t begin = random() % scan.size(), end = std::min(scan.size(), begin + random() % (scan.size() / 4));
      // Plain memory to the reader, as that of a scanner's driver is; the order of writes does not matter.
      volatile float* to = scan.data();
      for (std::size_t i = begin; i < end; ++i) to[i] = k % 3 == 0 ? original[i] : values[k % values.size()];
    }
  }

  std::atomic<bool> end_{false};
  std::thread writer_;
};

TEST(ChangingScan, CrashesNoHeightMap) {
  const auto reference = std::make_shared<Reference>(Grid<double>(61, 41, {-120, -80}, 4.0, 0.0));
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
  FrontEndOptions options;
  options.outliers = {4, 1.0, 2.0};
  options.spike = 0.5;
  const std::vector<float> original = hill();
  for (const bool organised : {true, false}) {
    FrontEnd front(reference, -far, far, looking_down(width, height), true, options, 2);
    const auto view = [&](const std::vector<float>& points) {
      return organised ? CloudView{points.data(), width, height} : CloudView{points.data(), width * height, 1};
    };
    const HeightMap before = front.run(view(original));
    std::vector<float> scan = original;
    {
      const Scribbler scribbler(scan, original);
      for (int k = 0; k < (organised ? rounds : rounds / 5); ++k) EXPECT_EQ(front.run(view(scan)).heights.size(), before.heights.size());
    }
    const HeightMap& after = front.run(view(original));
    for (std::size_t k = 0; k < before.heights.size(); ++k) {
      const float a = before.heights.values[k], b = after.heights.values[k];
      ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << k;  // nothing of them stays
    }
  }
}

}  // namespace
}  // namespace debulk::changing_scan_test
