#include "bindings/bind.hpp"

namespace debulk {

void bind_net(pybind11::module_&) {}

}  // namespace debulk
