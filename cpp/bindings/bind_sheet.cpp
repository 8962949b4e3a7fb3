#include "bindings/bind.hpp"

namespace debulk {

void bind_sheet(pybind11::module_&) {}

}  // namespace debulk
