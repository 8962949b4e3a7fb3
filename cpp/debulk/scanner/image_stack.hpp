#pragma once

#include <cstddef>
#include <vector>

namespace debulk {

// The images of the fringes from one camera: `exposures` times `steps * periods` images of `pixels` grey values each,
// the shortest exposure first. Within an exposure, all steps of the first number of periods come first, then those of
// the second, and so on.
template <class T>
struct ImageStack {
  std::vector<const T*> images;  // exposure by exposure
  int exposures = 1;
  long pixels = 0;

  int images_each() const { return static_cast<int>(images.size()) / exposures; }
  const T* const* exposure(int e) const { return images.data() + static_cast<std::size_t>(e) * static_cast<std::size_t>(images_each()); }
};

}  // namespace debulk
