#pragma once

#include <memory>

#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/segment.hpp"
#include "debulk/surface/height_map.hpp"

namespace debulk {

// The pockets of one height map, and their feet.
struct FoundPockets {
  Segmentation segmentation;
  FootMap feet;
};

// Finds the pockets and the feet in one height map after another, as segment() and find_feet() do. The memory of one of
// the last two results is reused if nobody holds it any more, because the last report still holds its own while the next
// scan is inspected. A result that is held never changes.
class PocketFinder {
 public:
  // Throws InputError and Stopped.
  std::shared_ptr<const FoundPockets> run(const HeightMap& map, const SegmentOptions& pockets, const FootOptions& feet, int threads = 0,
                                          const Stop& stop = Stop());

 private:
  Segmenter segmenter_;
  std::shared_ptr<FoundPockets> last_, before_;
};

}  // namespace debulk
