#include "bindings/bind.hpp"

namespace debulk {

void bind_verdict(pybind11::module_&) {}

}  // namespace debulk
