#include "debulk/pocket/components.hpp"

#include <algorithm>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

// Sorts runs by label (1 ..) and otherwise keeps their order.
template <class Label>
void sort_by_label(const std::vector<Run>& runs, std::size_t count, const Label& label, Components& out) {
  out.runs.resize(runs.size());
  out.starts.assign(count + 2, 0);
  for (std::size_t k = 0; k < runs.size(); ++k) ++out.starts[label(k) + 1];
  for (std::size_t r = 2; r < out.starts.size(); ++r) out.starts[r] += out.starts[r - 1];
  for (std::size_t k = 0; k < runs.size(); ++k) out.runs[out.starts[label(k)]++] = runs[k];  // starts move up one component
  out.starts.pop_back();
}

}  // namespace

void complement(const std::vector<Run>& foreground, int nx, int ny, std::vector<Run>& out) {
  out.clear();
  auto run = foreground.begin();
  for (int j = 0; j < ny; ++j) {
    int at = 0;
    for (; run != foreground.end() && run->row == j; ++run) {
      if (run->begin > at) out.push_back({j, at, run->begin});
      at = run->end;
    }
    if (at < nx) out.push_back({j, at, nx});
  }
}

const std::vector<Run>& RunFilling::run(const std::vector<Run>& foreground, int nx, int ny) {
  complement(foreground, nx, ny, background_);
  join_runs(background_, 0, first_);
  open_.assign(background_.size(), 0);
  for (std::size_t k = 0; k < background_.size(); ++k) {
    const Run& run = background_[k];
    if (run.row == 0 || run.row == ny - 1 || run.begin == 0 || run.end == nx) open_[static_cast<std::size_t>(first_[k])] = 1;
  }
  outside_.clear(), holes_.clear();
  for (std::size_t k = 0; k < background_.size(); ++k)
    (open_[static_cast<std::size_t>(first_[k])] ? outside_ : holes_).push_back(background_[k]);
  complement(outside_, nx, ny, filled_);
  return filled_;
}

long Components::points(std::size_t component) const {
  long sum = 0;
  for (const Run* run = begin(component); run != end(component); ++run) sum += run->end - run->begin;
  return sum;
}

const Components& RunJoining::run(const std::vector<Run>& foreground) {
  join_runs(foreground, 1, label_);
  int count = 0;
  for (std::size_t k = 0; k < label_.size(); ++k) {
    const auto first = static_cast<std::size_t>(label_[k]);  // not after k
    label_[k] = first == k ? ++count : label_[first];
  }
  sort_by_label(
      foreground, static_cast<std::size_t>(count), [&](std::size_t k) { return static_cast<std::size_t>(label_[k]); }, components_);
  return components_;
}

Components labelled(const Grid<std::int32_t>& labels, int count, int threads) {
  StripRuns strips;
  strips.clear(labels.ny);
  parallel_for(labels.ny, StripRuns::rows, threads, [&](long first, long last) {
    std::vector<Run>& runs = strips.strip(first);
    for (int j = static_cast<int>(first); j < last; ++j) {
      const std::int32_t* row = &labels.values[labels.index(0, j)];
      for (int i = 0; i < labels.nx;) {
        const int begin = i;
        const std::int32_t here = row[i];
        while (i < labels.nx && row[i] == here) ++i;
        if (here >= 1 && here <= count) runs.push_back({j, begin, i});
      }
    }
  });
  const std::vector<Run>& runs = strips.join();
  Components out;
  sort_by_label(
      runs, static_cast<std::size_t>(count), [&](std::size_t k) { return static_cast<std::size_t>(labels.at(runs[k].begin, runs[k].row)); },
      out);
  return out;
}

void paint(const Components& components, std::size_t component, std::int32_t label, Grid<std::int32_t>& labels) {
  for (const Run* run = components.begin(component); run != components.end(component); ++run) {
    std::int32_t* row = &labels.values[labels.index(0, run->row)];
    std::fill(row + run->begin, row + run->end, label);
  }
}

}  // namespace debulk
