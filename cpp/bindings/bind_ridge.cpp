#include "bindings/bind.hpp"

namespace debulk {

void bind_ridge(pybind11::module_&) {}

}  // namespace debulk
