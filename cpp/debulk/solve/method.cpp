#include "debulk/solve/method.hpp"

#include "debulk/core/error.hpp"
#include "debulk/solve/interior_point.hpp"
#include "debulk/solve/ipopt.hpp"
#include "debulk/solve/nlopt.hpp"

namespace debulk {

std::vector<std::string> method_names() {
  return {"auto", "interior_point", "ipopt", "nlopt"};
}

Method method(const std::string& name) {
  if (name == "auto" || name == "interior_point") return minimise_with_interior_point;
  if (name == "ipopt") return minimise_with_ipopt;
  if (name == "nlopt") return minimise_with_nlopt;
  std::string known;
  for (const std::string& other : method_names()) known += (known.empty() ? "\"" : ", \"") + other + "\"";
  throw InputError("method: expected one of " + known + ", but got \"" + name + "\"");
}

}  // namespace debulk
