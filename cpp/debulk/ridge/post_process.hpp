#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/nominal_ply.hpp"
#include "debulk/net/net.hpp"
#include "debulk/ridge/bridge_hold.hpp"
#include "debulk/ridge/ridge_line.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

struct RidgeOptions {
  double thickness = kNominalThicknessMm;  // mm, t, nominal
  double bulk_factor = 1.2;                // beta: the consolidated ply is t / beta thick
  // mm; a node up to this height above the mold touches it. 0 means t / 30. That is ten times the penetration that a
  // certificate allows; at the finest spacing of the paper (2.4 mm) it holds 0.04 um of excess, a thousandth of what an
  // elastic fold of height t needs.
  double touch = 0.0;

  double consolidated() const { return thickness / bulk_factor; }          // mm
  double touch_gap() const { return touch > 0 ? touch : thickness / 30; }  // mm
  void check() const;
};

struct PostProcessed {
  std::vector<double> gaps;             // mm above the mold, one per node: top of the consolidated ply, or of the ridge
  std::vector<std::uint8_t> is_ridge;   // one per node: 1 at the peak of a ridge
  std::vector<std::uint8_t> is_bridge;  // one per node: 1 where the ply is too short to reach the mold
  std::vector<RidgeSection> sections;   // of the ridges, in the order in which they were formed: from the largest gap down
  double ridge_height = 0.0;            // mm, of the highest ridge; 0: there is none
  double ridge_length = 0.0;            // mm, of the longest connected ridge; 0: there is none
  double bridge_height = 0.0;           // mm, of the highest bridging node; 0: there is none
  std::vector<std::uint8_t> drawn_in;   // one per node: 1 where the ply would bridge but is drawn in instead
  double drawn_in_height = 0.0;         // mm, height in the model of the highest node drawn in; 0: there is none
  Pull drawn_in_pull;                   // of the section through that node
  double rms = 0.0;                     // mm, of `gaps` over the nodes inside the perimeter that are not drawn in
  double excess_length = 0.0;           // mm, largest_fibre_excess()
};

// Turns the coarse net at the minimum into the shape of the ply on the mold (paper, "Post-Processing the Results";
// docs/model.md, section 5). The nodes are visited from the largest gap down (ties: the lower number first):
//  - A node below touch_gap(), one that an earlier ridge has claimed, or one on the flank of both its fibres is not a top.
//  - Of the sections through a top, the one with the larger excess per length counts (ties: the first fibre). At the net's
//    border a section has only one side, and the formula uses that side.
//  - The peak gets ridge_height_of_excess(), if that is more than t / beta. Such a ridge is 2 t wide, less than a node
//    spacing, so the nodes between the peak and the section's ends lie on the base beside it: they are claimed and moved to
//    the mold. The ends are not claimed, because they may be tops across. Each node is adjusted once.
//  - A top without a ridge, but with a fibre shorter than its mold (the ply bridges a hollow), cannot be pressed down:
//    the nodes of that section keep their gap. (The crest of a ridge across a hollow is such a fibre too; there the
//    ridge comes first.)
//  - An exception is a bridge that friction cannot hold (pull_of(); if the hold is not known, it holds), neither in this
//    fibre nor in the other one if that is too short as well. Then the ply is drawn in and comes down. Its nodes are put
//    on the mold, but are not counted in the RMS.
// Finally every node that is not a ridge is offset by t / beta.
PostProcessed post_process(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours,
                           const std::vector<std::uint8_t>& inside, const Surface& surface, const RidgeOptions& options = {},
                           const BridgeHold& hold = {});

}  // namespace debulk
