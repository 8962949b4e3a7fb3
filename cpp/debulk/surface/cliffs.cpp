#include "debulk/surface/cliffs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "debulk/core/parallel.hpp"
#include "debulk/surface/pooled.hpp"

namespace debulk {
namespace {

constexpr double reach_mm = 40.0;    // of the strip on the lower side; ringing at its far border fades before the cliff
constexpr double steepest = 2.0;     // greatest slope of a surface: 63 degrees
constexpr double gap_most_mm = 12;   // greatest step across a gap, with a slope of at most 1
constexpr double noise_mm = 0.7;     // between two medians
constexpr double least_mm2 = 400.0;  // a smaller piece removes nothing
constexpr double on_mm = 60.0;       // from removed heights to where a surface goes on; the cliff leaves a gap there
constexpr int rings = 5;             // of nodes, 4 mm apart
constexpr int nobody = std::numeric_limits<int>::max();

// Pieces of surface: squares that are linked to their neighbours along rows and columns, or to the next square across
// a gap.
class Pieces {
 public:
  explicit Pieces(Grid<float> squares) : squares_(std::move(squares)), steep_(steep(squares_)), parent_(squares_.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (int j = 0; j < squares_.ny; ++j) link(squares_.nx, [&](int i) { return squares_.index(i, j); });
    for (int i = 0; i < squares_.nx; ++i) link(squares_.ny, [&](int j) { return squares_.index(i, j); });
  }

  // For each square the rank of its piece: 0 is the piece that stays beside all others; what the ply lies on goes before
  // what it does not. `nobody`: too small, or not seen.
  Grid<int> ranks(const Grid<std::uint8_t>& under_ply, int side) {
    struct Piece {
      std::size_t root = 0;
      double area = 0, height = 0;
      int under_ply = 0;
    };
    std::vector<Piece> pieces(squares_.size());
    for (std::size_t k = 0; k < squares_.size(); ++k) {
      if (!in_piece(k)) continue;
      Piece& piece = pieces[root(k)];
      piece.root = root(k), piece.area += squares_.spacing * squares_.spacing, piece.height += squares_.values[k];
      if (under_ply.size() != 0) piece.under_ply += marked(under_ply, k, side);
    }
    pieces.erase(std::remove_if(pieces.begin(), pieces.end(), [](const Piece& p) { return p.area < least_mm2; }), pieces.end());
    double largest = 0;
    int most_laid = 1;
    for (Piece& p : pieces) {
      largest = std::max(largest, p.area), most_laid = std::max(most_laid, p.under_ply);
      p.height /= p.area;
    }
    std::sort(pieces.begin(), pieces.end(), [&](const Piece& a, const Piece& b) {
      const bool a_laid = 8 * a.under_ply >= most_laid, b_laid = 8 * b.under_ply >= most_laid;
      if (a_laid != b_laid) return a_laid;
      const bool a_large = 8 * a.area >= largest, b_large = 8 * b.area >= largest;
      if (a_large != b_large) return a_large;
      return a_large && a.height != b.height ? a.height > b.height : a.root < b.root;
    });
    count_ = static_cast<int>(pieces.size());
    std::vector<int> rank(squares_.size(), nobody);
    for (std::size_t k = 0; k < pieces.size(); ++k) rank[pieces[k].root] = static_cast<int>(k);
    Grid<int> out = squares_.like<int>(nobody);
    for (std::size_t k = 0; k < squares_.size(); ++k)
      if (in_piece(k)) out.values[k] = rank[root(k)];
    return out;
  }
  int count() const { return count_; }

 private:
  template <class Index>
  void link(int count, const Index& index) {
    int last = -1;
    for (int i = 0; i < count; ++i) {
      const std::size_t here = index(i);
      if (!in_piece(here)) continue;
      if (last >= 0) {
        const std::size_t before = index(last);
        const double apart = (i - last) * squares_.spacing;
        const double most = i - last == 1 ? steepest * apart : std::min(apart, gap_most_mm);
        if (apart <= reach_mm && std::abs(squares_.values[here] - squares_.values[before]) <= most + noise_mm) {
          const std::size_t a = root(here), b = root(before);
          parent_[std::max(a, b)] = std::min(a, b);
        }
      }
      last = i;
    }
  }
  std::size_t root(std::size_t k) {
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }

  // Whether the middle of a square is marked, in a grid of which the square takes `side` by `side` cells.
  bool marked(const Grid<std::uint8_t>& marks, std::size_t k, int side) const {
    const int i = static_cast<int>(k) % squares_.nx * side + side / 2, j = static_cast<int>(k) / squares_.nx * side + side / 2;
    return marks.at(std::min(i, marks.nx - 1), std::min(j, marks.ny - 1)) != 0;
  }
  bool in_piece(std::size_t k) const { return steep_.values[k] == 0 && !std::isnan(squares_.values[k]); }
  // Squares beside which there is more of a step than a slope explains. They would link the two sides of a cliff,
  // because they hold points that fly between the sides or lie on the wall.
  static Grid<std::uint8_t> steep(const Grid<float>& squares) {
    auto out = squares.like<std::uint8_t>();
    const double most = steepest * 2 * std::sqrt(2.0) * squares.spacing + noise_mm;
    for (int j = 0; j < squares.ny; ++j)
      for (int i = 0; i < squares.nx; ++i) {
        float low = std::numeric_limits<float>::infinity(), high = -low;
        for (int b = std::max(0, j - 1); b <= std::min(squares.ny - 1, j + 1); ++b)
          for (int a = std::max(0, i - 1); a <= std::min(squares.nx - 1, i + 1); ++a)
            if (const float z = squares.at(a, b); !std::isnan(z)) low = std::min(low, z), high = std::max(high, z);
        out.at(i, j) = high - low > most;
      }
    return out;
  }

  Grid<float> squares_;
  Grid<std::uint8_t> steep_;
  std::vector<std::size_t> parent_;
  int count_ = 0;
};

// The lowest rank within `reach` squares, along rows and then along columns.
Grid<int> lowest_near(const Grid<int>& ranks, int reach, int threads, const Stop& stop) {
  Grid<int> rows = ranks, out = ranks;
  const auto pass = [&](const Grid<int>& from, Grid<int>& to, int di, int dj) {
    parallel_for(from.ny, 16, threads, stop, [&](long begin, long end) {
      for (int j = static_cast<int>(begin); j < end; ++j)
        for (int d = -reach; d <= reach; ++d) {
          if (j + d * dj < 0 || j + d * dj >= from.ny) continue;
          const int first = std::max(0, -d * di), last = std::min(from.nx, from.nx - d * di);
          const int* near = &from.values[from.index(0, j + d * dj)];
          int* lowest = &to.values[to.index(0, j)];
          for (int i = first; i < last; ++i) lowest[i] = std::min(lowest[i], near[i + d * di]);
        }
    });
  };
  pass(ranks, rows, 1, 0);
  out = rows;
  pass(rows, out, 0, 1);
  return out;
}

}  // namespace

Grid<std::uint8_t> hide_beside_cliffs(Grid<float>& heights, const Grid<std::uint8_t>& under_ply, int threads, const Stop& stop) {
  const int side = pool_side(heights);
  const Grid<float> squares = pooled_medians(heights, side, threads, stop);
  Pieces pieces(squares);
  const Grid<int> ranks = pieces.ranks(under_ply, side);
  if (pieces.count() < 2) return {};
  const Grid<int> stays_near = lowest_near(ranks, static_cast<int>(std::ceil(reach_mm / squares.spacing)), threads, stop);
  // Beside a piece of lower rank, only heights that continue that piece stay. A square at the cliff belongs to no
  // piece itself.
  const auto stays = [&](int i, int j, float z) {
    const int reach = ranks.at(i, j) == nobody ? 2 : 1;
    const double near_mm = steepest * (reach + 0.5) * squares.spacing + noise_mm;
    for (int b = std::max(0, j - reach); b <= std::min(ranks.ny - 1, j + reach); ++b)
      for (int a = std::max(0, i - reach); a <= std::min(ranks.nx - 1, i + reach); ++a)
        if (ranks.at(a, b) == stays_near.at(i, j) && std::abs(z - squares.at(a, b)) <= near_mm) return true;
    return false;
  };
  // A square at a cliff may hold heights of both sides.
  const auto at_border = [&](int i, int j) {
    for (int b = std::max(0, j - 1); b <= std::min(ranks.ny - 1, j + 1); ++b)
      for (int a = std::max(0, i - 1); a <= std::min(ranks.nx - 1, i + 1); ++a)
        if (ranks.at(a, b) != ranks.at(i, j)) return true;
    return false;
  };
  auto hidden = ranks.like<std::uint8_t>();
  parallel_for(ranks.ny, 4, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < ranks.nx; ++i) {
        if (stays_near.at(i, j) == nobody || (ranks.at(i, j) == stays_near.at(i, j) && !at_border(i, j))) continue;
        for (int y = j * side; y < std::min(heights.ny, (j + 1) * side); ++y)
          for (int x = i * side; x < std::min(heights.nx, (i + 1) * side); ++x) {
            float& z = heights.at(x, y);
            if (std::isnan(z) || stays(i, j, z)) continue;
            z = std::numeric_limits<float>::quiet_NaN();
            hidden.at(i, j) = 1;
          }
      }
  });
  return hidden;
}

Grid<std::uint8_t> above_cliffs(const Grid<float>& heights, int threads, const Stop& stop) {
  const int side = pool_side(heights);
  Pieces pieces(pooled_medians(heights, side, threads, stop));
  const Grid<int> ranks = pieces.ranks({}, side);
  if (pieces.count() < 2) return {};
  Grid<std::uint8_t> out = heights.like<std::uint8_t>();
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i) {
      int best = nobody;  // a square at a cliff belongs to no piece itself
      for (int b = std::max(0, j / side - 2); b <= std::min(ranks.ny - 1, j / side + 2); ++b)
        for (int a = std::max(0, i / side - 2); a <= std::min(ranks.nx - 1, i / side + 2); ++a) best = std::min(best, ranks.at(a, b));
      const int own = ranks.at(i / side, j / side);
      out.at(i, j) = own == 0 || (own == nobody && best == 0);
    }
  return out;
}

void go_on_over_cliffs(Grid<double>& nodes, const Grid<std::uint8_t>& squares) {
  const Grid<std::uint8_t> near = nodes_near(squares, nodes, on_mm);
  const auto known = [&](int i, int j) { return nodes.contains(i, j) && !std::isnan(nodes.at(i, j)); };
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<std::pair<std::size_t, double>> found;
    for (int j = 0; j < nodes.ny; ++j)
      for (int i = 0; i < nodes.nx; ++i) {
        if (near.at(i, j) == 0 || known(i, j)) continue;
        double sum = 0;
        int ways = 0;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di) {
            if (!known(i + di, j + dj) || !known(i + 2 * di, j + 2 * dj)) continue;
            const double first = nodes.at(i + di, j + dj), second = nodes.at(i + 2 * di, j + 2 * dj);
            const bool third = known(i + 3 * di, j + 3 * dj);  // the longer distance has less noise
            sum += third ? first + (first - nodes.at(i + 3 * di, j + 3 * dj)) / 2 : 2 * first - second;
            ++ways;
          }
        if (ways > 0) found.emplace_back(nodes.index(i, j), sum / ways);
      }
    for (const auto& [at, height] : found) nodes.values[at] = height;
  }
}

}  // namespace debulk
