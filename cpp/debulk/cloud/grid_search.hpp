#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Exact nearest neighbours in a cloud most of whose points form a sheet. The points are sorted into square cells on
// the two axes of largest extent, and a search goes outward, ring by ring of cells. A point outside the rings is at
// least as far away as the rings' border, because a projected distance never exceeds the distance. The search ends
// when the last neighbour found is not farther away than that.
class GridSearch {
 public:
  GridSearch(const CloudView& cloud, int neighbours, int threads, const Stop& stop);

  // Fills means[i] for the points, or a sample of one in `every`, that can be searched at a bounded cost, and returns the
  // indices of the others, in the order of their cells. (A vertical wall or a dense cluster overcrowds a cell; a point
  // far off the sheet needs many rings.)
  std::vector<std::uint32_t> mean_distances(float* means, std::uint32_t every = 1);

 private:
  struct Entry {
    float xyz[3];
    std::uint32_t index;
  };
  struct Search;  // the neighbours found so far

  void choose_cells();
  void sort_points();
  // The cell along one of the two axes. A point beyond the border belongs to the cell at the border.
  int cell(const float* xyz, int axis) const;
  // Visits whole rings until the result is certain. Returns false if the search was given up because there were more
  // than `budget` points and cells to look at.
  bool search(std::size_t entry, int column, int row, long budget, Search& found) const;
  void visit(const Entry& from, std::size_t begin, std::size_t end, Search& found) const;
  template <class Visit>
  void for_ring(int column, int row, int ring, const Visit& visit_run) const;
  double border_distance(const Entry& from, int column, int row, int ring) const;
  // The same for a point off the sheet, by rings of blocks of cells. Only those blocks are visited whose box is near
  // enough.
  bool search_blocks(std::size_t entry, int column, int row, long budget, Search& found) const;
  void make_blocks();

  CloudView cloud_;
  int neighbours_;
  int threads_;
  Stop stop_;
  int axis_[2] = {0, 1};               // the two axes of largest extent
  double low_[2] = {0.0, 0.0};         // mm, the grid's corner
  double side_ = 1.0;                  // mm, side of a cell
  int cells_[2] = {1, 1};              // columns, rows
  std::vector<std::uint32_t> starts_;  // where each cell's entries start, row by row; the end of the last follows
  std::vector<Entry> entries_;
  int blocks_[2] = {0, 0};                // columns, rows of blocks
  std::vector<Eigen::AlignedBox3f> box_;  // box round the points of each block
};

}  // namespace debulk
