# What every room is compiled with. Warnings become errors in the presets only: a user's newer compiler must not fail a build.
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

add_library(debulk_options INTERFACE)
target_include_directories(debulk_options INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/cpp> $<INSTALL_INTERFACE:include>)
target_compile_features(debulk_options INTERFACE cxx_std_17)
target_compile_options(debulk_options INTERFACE $<BUILD_INTERFACE:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wnon-virtual-dtor>)

# One wheel for every x86-64-v2 PC. No fused multiply-add and no fast-math: the same input gives the same bits.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(debulk_bits_options -march=x86-64-v2)
  # A program built for wider vectors must align Eigen's types as these libraries do, or memory taken on one side of the
  # border and freed on the other crashes.
  target_compile_definitions(debulk_options INTERFACE $<INSTALL_INTERFACE:EIGEN_MAX_ALIGN_BYTES=16>)
endif()
list(APPEND debulk_bits_options -ffp-contract=off)
target_compile_options(debulk_options INTERFACE $<BUILD_INTERFACE:${debulk_bits_options}>)

# For sources with wide loops (core/simd_dispatch.inl): what lets the compiler use wide instructions there; none of it changes a
# bit of the results. A sanitizer's build is not in a hurry at run time and compiles them as all others.
set(DEBULK_WIDE_OPTIONS -O3 -fno-math-errno -fno-trapping-math CACHE STRING "How hard the compiler works on them")
function(debulk_wide_loops)  # SOURCE ...
  set(options ${DEBULK_WIDE_OPTIONS} -Wno-psabi)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS "${options}")
  if(DEBULK_WIDE_OPTIONS)  # the compiler takes no header that was compiled with others
    set_source_files_properties(${ARGN} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# Headers that nearly all rooms include, parsed once: a second for each of a hundred sources, and the same code. Not by default: a
# compiler cache keeps nothing that was compiled with them, and tools of another compiler cannot read them.
option(DEBULK_PRECOMPILED "Precompile the common headers of the rooms" OFF)
set(debulk_common_headers <Eigen/Core> <algorithm> <cmath> <limits> <string> <vector>)
