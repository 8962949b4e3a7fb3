#include "debulk/pocket/pocket_finder.hpp"

namespace debulk {

std::shared_ptr<const FoundPockets> PocketFinder::run(const HeightMap& map, const SegmentOptions& pockets, const FootOptions& feet,
                                                      int threads, const Stop& stop) {
  if (last_.use_count() != 1) last_.swap(before_);
  if (last_.use_count() != 1) last_ = std::make_shared<FoundPockets>();
  segmenter_.reuse(std::move(last_->segmentation));
  segmenter_.run(map.heights, pockets, &map.measured, &map.before_median, threads, stop);
  last_->segmentation = segmenter_.take();
  find_feet(last_->segmentation, feet, last_->feet, threads, stop);
  return last_;
}

}  // namespace debulk
