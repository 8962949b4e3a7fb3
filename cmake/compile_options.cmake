# What every room is compiled with. Warnings become errors in the presets only: a user's newer compiler must not fail a build.
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

add_library(debulk_options INTERFACE)
target_include_directories(debulk_options INTERFACE ${PROJECT_SOURCE_DIR}/cpp)
target_compile_options(debulk_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor)

# One wheel for every x86-64-v2 PC. No fused multiply-add and no fast-math: the same input gives the same bits.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_options(debulk_options INTERFACE -march=x86-64-v2)
endif()
target_compile_options(debulk_options INTERFACE -ffp-contract=off)

# For sources with wide loops (core/simd_dispatch.inl): what lets the compiler use wide instructions there; none of it changes a
# bit of the results.
set(debulk_simd_options -O3 -fno-math-errno -fno-trapping-math -Wno-psabi)
