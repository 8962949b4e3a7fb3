#include "bindings/bind.hpp"

namespace debulk {

void bind_solve(pybind11::module_&) {}

}  // namespace debulk
