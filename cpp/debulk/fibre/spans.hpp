#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "debulk/fibre/fibre_lines.hpp"
#include "debulk/fibre/gaps_along.hpp"

namespace debulk {

// A stretch of a line off the mold; along the ply's edge, where nothing is read, the ply goes on as it came. Its excess is e(s) = sqrt(1 +
// (m' + g')^2) - sqrt(1 + m'^2), summed over the stretch and over its tails, on which the ply comes down from the mold tolerance to the
// mold.
struct FibreSpan {
  int first = 0, last = 0;          // points of the line, the first and the last off the mold
  int top = 0;                      // the point with the largest gap
  double gap = 0.0;                 // mm, that gap, by the finer mean
  double aside = 0.0;               // mm from that point across the line, within which the crest may lie unread
  std::array<int, 2> unread{};      // points beyond them along the ply's edge
  std::array<double, 2> tails{};    // mm, lengths of the tails
  double fine = 0.0, coarse = 0.0;  // mm, excess by either mean, with the noise's share in it
  double length = 0.0;              // mm, of what is summed, tails included
  double bend = 0.0;                // 1/mm, sum of the squared curvature of the ply along the line
  double turn = 0.0;                // mm/rad, change of the excess as the fibre's direction turns
};

// What the flat ply of the same scan shows of its noise, per mm of line.
struct FlatNoise {
  double length = 0.0;              // mm of flat ply that were read
  double fine = 0.0, coarse = 0.0;  // mm, false excess in all
  double blocks = 0.0;              // number of blocks of kBlock steps, and the sums of their false low end and its square
  double block_sum = 0.0, block_square = 0.0;
  double triples = 0.0, second_square = 0.0;  // sums of squared second differences of the gap over the finer mean's width

  void add(const FlatNoise& other);
  double fine_per_mm() const { return length > 0 ? fine / length : 0.0; }
  double coarse_per_mm() const { return length > 0 ? coarse / length : 0.0; }
  // mm2 per mm of line: variance of the false low end.
  double variance_per_mm(double step) const;
  // mm2: variance of the gap.
  double gap_variance() const { return triples > 0 ? second_square / (6 * triples) : 0.0; }
};

struct LineSpans {
  std::vector<FibreSpan> spans;
  std::vector<Stretch> gaps;  // on which nothing is known
  FlatNoise noise;
};

// Reads line after line, in memory that is used again.
class LineReader {
 public:
  LineReader(const FibreOptions& options, const GapTiles& tiles, const GapsAlong& along);
  LineSpans read(const FibreLine& line, const LineCourse& course);

 private:
  enum Mark : std::uint8_t { kRaised = 1, kUnknown = 2, kOff = 4, kFlat = 8 };

  void read(const RaisedStretch& stretch);
  void find_spans();
  void find_gaps();
  bool at_edge(int k) const;
  double to_edge(int at) const;
  int tail(int at, int side, int limit) const;
  void measure(FibreSpan& span, int before, int after);
  void read_noise(std::size_t from);
  double fine(int k) const { return static_cast<double>(points_[k].fine); }
  int count() const { return static_cast<int>(marks_.size()); }
  bool is(int k, Mark mark) const { return (marks_[static_cast<std::size_t>(k)] & mark) != 0; }

  const FibreOptions& options_;
  const GapTiles& tiles_;
  const GapsAlong& along_;
  const double fine_mm_, lost_;  // width of the finer mean; how much more than the coarser one has the low end
  const FibreLine* line_ = nullptr;
  double step_ = 0.0;
  int begin_ = 0, wide_ = 1;           // of the stretch; steps over the finer mean
  const PointGaps* points_ = nullptr;  // of the stretch
  std::vector<std::uint8_t> marks_;
  std::vector<double> by_fine_, by_coarse_, bend_;  // of the steps, and of the points
  LineSpans out_;
};

}  // namespace debulk
