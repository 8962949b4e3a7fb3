#include "debulk/solve/skyline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "support/cholesky.hpp"
#include "support/dense.hpp"

namespace debulk {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::Exact;
using Pattern = std::vector<std::pair<int, int>>;

constexpr double kEps = std::numeric_limits<double>::epsilon();
const std::vector<int> kSizes = {1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 15, 16, 17, 31, 33, 64, 100, 177, 250, 400};

// A random profile: every column reaches down to a random row, some no further than its diagonal, a few a long way.
Pattern random_profile(int size, std::mt19937& engine) {
  Pattern out;
  const int widest = std::uniform_int_distribution<int>(0, std::max(0, std::min(size - 1, 60)))(engine);
  for (int column = 0; column < size; ++column) {
    const bool far = engine() % 50 == 0;
    const int last = std::min(size - 1, column + std::uniform_int_distribution<int>(0, far ? size : widest)(engine));
    for (int row = column + 1; row <= last; ++row)
      if (row == last || engine() % 3 != 0) out.emplace_back(row, column);
  }
  return out;
}

Pattern full(int size) {
  Pattern out;
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < row; ++column) out.emplace_back(row, column);
  return out;
}

// Symmetric, with the entries of the pattern random and a diagonal that makes it positive definite, each row at another scale.
MatrixXd random_positive(int size, const Pattern& pattern, std::mt19937& engine) {
  std::normal_distribution<double> normal;
  MatrixXd a = MatrixXd::Zero(size, size);
  for (const auto& [row, column] : pattern) a(row, column) = a(column, row) = normal(engine);
  for (int i = 0; i < size; ++i) a(i, i) = a.row(i).cwiseAbs().sum() + std::abs(normal(engine)) + 1e-3;
  VectorXd scale(size);
  for (int i = 0; i < size; ++i) scale[i] = std::exp(2 * normal(engine));
  return scale.asDiagonal() * a * scale.asDiagonal();
}

// Symmetric, dense, with these eigenvalues.
MatrixXd with_eigenvalues(const VectorXd& eigenvalues, std::mt19937& engine) {
  std::normal_distribution<double> normal;
  const long size = eigenvalues.size();
  Exact seed(size, size);
  for (long j = 0; j < size; ++j)
    for (long i = 0; i < size; ++i) seed(i, j) = normal(engine);
  const Exact q = test::orthogonal(seed);
  const MatrixXd a = (q * eigenvalues.cast<long double>().asDiagonal() * q.transpose()).cast<double>();
  return (a + a.transpose()) / 2;
}

Skyline filled(const MatrixXd& a, const Pattern& pattern) {
  Skyline out(static_cast<int>(a.rows()), pattern);
  for (int i = 0; i < out.size(); ++i) out.values()[out.diagonal(i)] = a(i, i);
  for (const auto& [row, column] : pattern) out.values()[out.place(row, column)] = a(row, column);
  return out;
}

// U, read off the rows of the skyline.
MatrixXd upper(const Skyline& s) {
  MatrixXd u = MatrixXd::Zero(s.size(), s.size());
  for (int i = 0; i < s.size(); ++i)
    for (int k = i; k <= s.last(i); ++k) u(i, k) = s.values()[s.place(k, i)];
  return u;
}

VectorXd random_vector(long size, std::mt19937& engine) {
  std::normal_distribution<double> normal;
  VectorXd out(size);
  for (long i = 0; i < size; ++i) out[i] = normal(engine);
  return out;
}

// Higham, Accuracy and Stability of Numerical Algorithms, 2nd edition, section 10.1: the factor satisfies
// |A - U^T U| <= g(n + 1) |U^T||U| entry by entry, and the solution |b - A x| <= g(3 n + 1) |U^T||U||x|, g(k) = k eps / (1 - k eps)
// with eps the unit roundoff. Here n is the longest row; the reciprocal of the pivot costs one rounding more in each.
void expect_backward_stable(const MatrixXd& a, const Skyline& factor, const VectorXd& b, const VectorXd& x) {
  const MatrixXd u = upper(factor);
  double longest = 0;
  for (long i = 0; i < u.rows(); ++i) longest = std::max(longest, static_cast<double>((u.col(i).array() != 0).count()));
  const Exact sizes = (u.cwiseAbs().transpose() * u.cwiseAbs()).cast<long double>(), exact = u.cast<long double>();
  const Exact wrong = (a.cast<long double>() - exact.transpose() * exact).cwiseAbs();
  const Exact left = (b.cast<long double>() - a.cast<long double>() * x.cast<long double>()).cwiseAbs();
  const long double unit = kEps / 2;
  EXPECT_LE((wrong - (2 * longest + 4) * unit * sizes).maxCoeff(), 0) << "U^T U of size " << a.rows();
  EXPECT_LE((left - (4 * longest + 8) * unit * (sizes * x.cwiseAbs().cast<long double>())).maxCoeff(), 0) << "A x - b of size " << a.rows();
}

TEST(Skyline, FactorAndSolutionAreBackwardStableOnRandomProfiles) {
  std::mt19937 engine(1);
  for (const int size : kSizes)
    for (int again = 0; again < (size < 100 ? 12 : 2); ++again) {
      const Pattern pattern = random_profile(size, engine);
      const MatrixXd a = random_positive(size, pattern, engine);
      Skyline s = filled(a, pattern);
      const VectorXd b = random_vector(size, engine);
      VectorXd product, x = b;
      s.multiply(b, product);
      EXPECT_LE(((product - a * b).array().abs() - (size + 2) * kEps * (a.cwiseAbs() * b.cwiseAbs()).array()).maxCoeff(), 0) << size;
      ASSERT_TRUE(s.factor()) << size;
      s.solve(x);
      expect_backward_stable(a, s, b, x);
      const MatrixXd reference = test::cholesky(a);
      for (int i = 0; i < size; ++i)  // scaled by the row: of a dominant diagonal no pivot is small
        EXPECT_LE((upper(s).row(i) - reference.row(i)).norm(), 1e-12 * size * reference.row(i).norm()) << size << ' ' << i;
    }
}

// The error of the solution is the condition times what the factorisation rounds, and no more; Eigen's dense one does the same.
TEST(Skyline, LosesAsManyDigitsAsTheConditionHas) {
  std::mt19937 engine(2);
  for (const int size : {2, 5, 12, 30, 60})
    for (const double digits : {0.0, 2.0, 5.0, 8.0, 11.0, 13.0, 14.0}) {
      if (size > 12 && digits > 13) continue;  // size times eps times condition is above 1/10: the bound promises nothing
      const double condition = std::pow(10, digits);
      VectorXd eigenvalues(size);
      for (int i = 0; i < size; ++i) eigenvalues[i] = std::pow(10, -digits * i / (size - 1));
      const MatrixXd a = with_eigenvalues(eigenvalues, engine);
      Skyline s = filled(a, full(size));
      ASSERT_TRUE(s.factor()) << size << " 1e" << digits;
      const VectorXd b = random_vector(size, engine);
      VectorXd x = b;
      s.solve(x);
      expect_backward_stable(a, s, b, x);
      const VectorXd exact = test::exact_solution(a.cast<long double>(), b.cast<long double>());
      const VectorXd eigen = test::cholesky_solution(a, b);
      EXPECT_LE((x - exact).norm(), 2 * size * kEps * condition * exact.norm()) << size << " 1e" << digits;
      EXPECT_LE((x - exact).norm(), 30 * (eigen - exact).norm() + 30 * kEps * exact.norm()) << size << " 1e" << digits;
    }
}

// Shifted to either side of its smallest eigenvalue by little: accepted exactly where it is positive definite.
TEST(Skyline, RefusesWhatIsNotPositiveDefiniteAndNothingElse) {
  std::mt19937 engine(3);
  for (const int size : {1, 2, 3, 4, 5, 6, 7, 8, 9, 20, 41, 120})
    for (int again = 0; again < 8; ++again) {
      const Pattern pattern = random_profile(size, engine);
      const MatrixXd a = random_positive(size, pattern, engine);
      const VectorXd diagonal = a.diagonal().cwiseSqrt();
      const MatrixXd even = diagonal.cwiseInverse().asDiagonal() * a * diagonal.cwiseInverse().asDiagonal();
      const double least = test::eigenvalues(even)[0];
      for (const double off : {1e-2, 1e-6, 1e-9}) {
        const MatrixXd unit = MatrixXd::Identity(size, size);
        EXPECT_TRUE(filled(even - (least - off) * unit, pattern).factor()) << size << ' ' << off;
        EXPECT_FALSE(filled(even - (least + off) * unit, pattern).factor()) << size << ' ' << off;
      }
    }
}

// Rows go in panels of four: a bad pivot anywhere in one, first, last and in the last short panel, is seen.
TEST(Skyline, SeesABadPivotWhereverItStands) {
  for (int size = 1; size <= 13; ++size)
    for (int bad = 0; bad < size; ++bad)
      for (const double value : {0.0, -1.0, -1e-300, std::nan(""), std::numeric_limits<double>::infinity()}) {
        MatrixXd a = 2 * MatrixXd::Identity(size, size);
        for (int i = 0; i + 1 < size; ++i) a(i, i + 1) = a(i + 1, i) = 0.5;
        a(bad, bad) = value;
        EXPECT_FALSE(filled(a, full(size)).factor()) << size << ' ' << bad << ' ' << value;
      }
}

// A free chain of springs: singular exactly, and with one spring of stiffness e to the ground so weak that 16 of its digits
// are nearly gone. Under a force f on its last node every node moves by f / e, and the springs stretch by f each.
TEST(Skyline, TellsSingularFromNearlySingular) {
  for (const int size : {2, 3, 4, 5, 40, 399}) {
    Pattern pattern;
    MatrixXd a = MatrixXd::Zero(size, size);
    for (int i = 0; i + 1 < size; ++i) {
      pattern.emplace_back(i + 1, i);
      a(i, i) += 1;
      a(i + 1, i + 1) += 1;
      a(i + 1, i) = a(i, i + 1) = -1;
    }
    EXPECT_FALSE(filled(a, pattern).factor()) << size;
    for (const double ground : {0x1p-10, 0x1p-30, 0x1p-38}) {  // representable beside 1
      a(0, 0) = 1 + ground;
      Skyline s = filled(a, pattern);
      ASSERT_TRUE(s.factor()) << size << ' ' << ground;
      VectorXd x = VectorXd::Zero(size);
      x[size - 1] = 1;
      s.solve(x);
      const double condition = 4 * size / ground;
      for (int i = 0; i < size; ++i) EXPECT_NEAR(x[i] * ground, 1 + i * ground, 20 * condition * kEps) << size << ' ' << i;
    }
    a(0, 0) = 1 + 0x1p-49;  // below 1e-14 of the diagonal: rounding, not stiffness
    EXPECT_FALSE(filled(a, pattern).factor()) << size;
  }
}

// Nothing but the units changes: a matrix in units a power of four larger has a factor a power of two larger, to the bit. And a
// second factorisation in the same object, after a refusal too, knows nothing of the first.
TEST(Skyline, GivesTheSameBitsInOtherUnitsAndAgain) {
  std::mt19937 engine(4);
  for (const int size : {1, 5, 30, 133}) {
    const Pattern pattern = random_profile(size, engine);
    const MatrixXd a = random_positive(size, pattern, engine);
    const Skyline plain = filled(a, pattern);
    Skyline once = plain, again = filled(-a, pattern);
    ASSERT_TRUE(once.factor());
    ASSERT_FALSE(again.factor());
    again.values() = plain.values();
    ASSERT_TRUE(again.factor());
    EXPECT_EQ(again.values(), once.values());
    for (const int power : {-120, 1, 90}) {
      Skyline scaled = filled(std::ldexp(1.0, 2 * power) * a, pattern);
      ASSERT_TRUE(scaled.factor());
      const MatrixXd expected = upper(once).unaryExpr([power](double value) { return std::ldexp(value, power); });
      EXPECT_EQ(upper(scaled), expected) << power;
    }
  }
}

// Vectors of two, four and eight numbers: the same factor, the same products and the same solutions, to the bit.
TEST(Skyline, GivesTheSameBitsOnEveryMachine) {
  std::mt19937 engine(5);
  for (const int size : kSizes) {
    const Pattern pattern = random_profile(size, engine);
    const MatrixXd a = random_positive(size, pattern, engine);
    const VectorXd b = random_vector(size, engine);
    MatrixXd first;
    for (const Isa isa : {Isa::base, Isa::v3, Isa::v4}) {
      if (isa > best_isa()) continue;
      Skyline s(size, pattern, isa);
      s.values() = filled(a, pattern).values();
      MatrixXd found(size, size + 2);
      VectorXd product, x = b;
      s.multiply(b, product);
      ASSERT_TRUE(s.factor());
      s.solve(x);
      found << upper(s), product, x;
      if (isa == Isa::base) first = found;
      EXPECT_EQ(found, first) << size << ' ' << static_cast<int>(isa);
    }
  }
}

}  // namespace
}  // namespace debulk
