#include "bindings/bind.hpp"

namespace debulk {

void bind_surface(pybind11::module_&) {}

}  // namespace debulk
