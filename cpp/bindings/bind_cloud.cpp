#include "bindings/bind.hpp"

namespace debulk {

void bind_cloud(pybind11::module_&) {}

}  // namespace debulk
