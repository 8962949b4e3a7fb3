#include "debulk/core/row_runs.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "debulk/core/parallel.hpp"

namespace debulk {

void StripRuns::clear(int image_rows) {
  strips_.resize(static_cast<std::size_t>((image_rows + rows - 1) / rows));
  for (std::vector<Run>& strip : strips_) strip.clear();
}

const std::vector<Run>& StripRuns::join() {
  runs_.clear();
  for (const std::vector<Run>& strip : strips_) runs_.insert(runs_.end(), strip.begin(), strip.end());
  return runs_;
}

std::vector<Run> find_runs(const Grid<std::uint8_t>& image, bool wanted, int threads) {
  StripRuns found;
  found.clear(image.ny);
  parallel_for(image.ny, StripRuns::rows, threads, [&](long first, long last) {
    std::vector<Run>& part = found.strip(first);
    for (int j = static_cast<int>(first); j < last; ++j) {
      const std::uint8_t* row = &image.values[image.index(0, j)];
      for (int i = 0; i < image.nx;) {
        // Eight zeros are skipped at once, and all that is between two zeros: most of an image is no run.
        for (std::uint64_t eight = 0; wanted && i + 8 <= image.nx; i += 8) {
          std::memcpy(&eight, row + i, sizeof eight);
          if (eight != 0) break;
        }
        while (wanted && i < image.nx && row[i] == 0) ++i;
        if (!wanted) {
          const void* zero = std::memchr(row + i, 0, static_cast<std::size_t>(image.nx - i));
          i = zero ? static_cast<int>(static_cast<const std::uint8_t*>(zero) - row) : image.nx;
        }
        const int begin = i;
        while (i < image.nx && (row[i] != 0) == wanted) ++i;
        if (i > begin) part.push_back({j, begin, i});
      }
    }
  });
  return found.join();
}

void join_runs(const std::vector<Run>& runs, int reach, std::vector<int>& parent) {
  parent.resize(runs.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int k) {
    while (parent[static_cast<std::size_t>(k)] != k) {
      int& up = parent[static_cast<std::size_t>(k)];
      k = up = parent[static_cast<std::size_t>(up)];
    }
    return k;
  };
  std::size_t above = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    while (above < k &&
           (runs[above].row < runs[k].row - 1 || (runs[above].row == runs[k].row - 1 && runs[above].end + reach <= runs[k].begin)))
      ++above;
    for (std::size_t a = above; a < k && runs[a].row == runs[k].row - 1 && runs[a].begin < runs[k].end + reach; ++a) {
      const int one = root(static_cast<int>(a)), other = root(static_cast<int>(k));
      parent[static_cast<std::size_t>(std::max(one, other))] = std::min(one, other);
    }
  }
  for (std::size_t k = 0; k < runs.size(); ++k) parent[k] = root(static_cast<int>(k));
}

std::vector<int> join_runs(const std::vector<Run>& runs, int reach) {
  std::vector<int> parent;
  join_runs(runs, reach, parent);
  return parent;
}

}  // namespace debulk
