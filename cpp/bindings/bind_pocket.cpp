#include "bindings/bind.hpp"

namespace debulk {

void bind_pocket(pybind11::module_&) {}

}  // namespace debulk
