#pragma once

#include <string>

#include "debulk/core/error.hpp"
#include "debulk/pocket/patch.hpp"

namespace debulk {

inline PatchMode patch_mode(const std::string& name) {
  require(name == "foot" || name == "paper", "mode", "\"foot\" or \"paper\"", "\"" + name + "\"");
  return name == "paper" ? PatchMode::paper : PatchMode::foot;
}

inline std::string name_of(PatchMode mode) {
  return mode == PatchMode::paper ? "paper" : "foot";
}

}  // namespace debulk
