#include <pybind11/stl.h>

#include <map>
#include <string>

#include <IpoptConfig.h>
#include <nlopt.h>
#include <pcl/pcl_config.h>
#include <boost/version.hpp>
#include <Eigen/Core>

#include "bindings/bind.hpp"

namespace py = pybind11;

namespace debulk {
namespace {

// Version and digits of the C++ sources that this is built from: the Python files refuse another build's (debulk/build.py).
constexpr const char kSources[] =
#include "bindings/core_sources.txt"
    ;

std::string joined(int major, int minor, int patch) {
  return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
}

std::map<std::string, std::string> versions() {
  int major, minor, patch;
  nlopt_version(&major, &minor, &patch);
  return {{"Eigen", joined(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"PCL", joined(PCL_MAJOR_VERSION, PCL_MINOR_VERSION, PCL_REVISION_VERSION)},
          {"Boost", joined(BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000, BOOST_VERSION % 100)},
          {"Ipopt", IPOPT_VERSION},
          {"NLopt", joined(major, minor, patch)},
          {"pybind11", joined(PYBIND11_VERSION_MAJOR, PYBIND11_VERSION_MINOR, PYBIND11_VERSION_PATCH)},
#if defined(__clang__)
          {"compiler", "Clang " __clang_version__},
#else
          {"compiler", "GCC " __VERSION__},
#endif
          {"compiler options", DEBULK_COMPILER_OPTIONS}};
}

// Returns the widest instruction set that the wide loops may use; the package itself requires no more than x86-64-v2.
std::string instruction_set() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("x86-64-v4")) return "x86-64-v4";
  if (__builtin_cpu_supports("x86-64-v3")) return "x86-64-v3";
  if (__builtin_cpu_supports("x86-64-v2")) return "x86-64-v2";
  return "x86-64";
#else
  return "no x86-64";
#endif
}

}  // namespace

void bind_build(py::module_ m) {
  m.attr("build") = std::string(DEBULK_VERSION " ") + kSources;
  m.def("build_versions", &versions);
  m.def("instruction_set", &instruction_set);
}

}  // namespace debulk
