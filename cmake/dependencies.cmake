# Imported targets for what Debian ships without (usable) CMake files. The headers of PCL and FLANN lie in a private
# prefix, made by cmake/install_dependencies.sh: find_package(PCL) would ask for VTK, Qt and the rest of libpcl-dev.
set(DEBULK_DEPS ${PROJECT_SOURCE_DIR}/.deps CACHE PATH "Prefix with the unpacked PCL headers")

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)

function(debulk_imported target)
  cmake_parse_arguments(ARG "" "HEADER" "LIBRARIES;INCLUDE_SUFFIXES;HINTS" ${ARGN})
  find_path(${target}_INCLUDE ${ARG_HEADER} HINTS ${ARG_HINTS} PATH_SUFFIXES ${ARG_INCLUDE_SUFFIXES})
  if(NOT ${target}_INCLUDE)
    message(FATAL_ERROR "debulk: ${ARG_HEADER} was not found. Run cmake/install_dependencies.sh ${DEBULK_DEPS} first.")
  endif()
  add_library(debulk::${target} INTERFACE IMPORTED)
  target_include_directories(debulk::${target} SYSTEM INTERFACE ${${target}_INCLUDE})
  foreach(library ${ARG_LIBRARIES})
    find_library(${target}_${library} NAMES ${library} lib${library}.so.1.13)
    if(NOT ${target}_${library})
      message(FATAL_ERROR "debulk: the library ${library} was not found. Run cmake/install_dependencies.sh ${DEBULK_DEPS} first.")
    endif()
    target_link_libraries(debulk::${target} INTERFACE ${${target}_${library}})
  endforeach()
endfunction()

debulk_imported(flann HEADER flann/flann.hpp HINTS ${DEBULK_DEPS}/usr/include)
debulk_imported(pcl HEADER pcl/point_cloud.h HINTS ${DEBULK_DEPS}/usr/include INCLUDE_SUFFIXES pcl-1.13
                LIBRARIES pcl_common pcl_kdtree pcl_search)
target_link_libraries(debulk::pcl INTERFACE debulk::flann Eigen3::Eigen)
# Debian's PCL is built without AVX. Were our code to use a wider alignment, memory allocated on one side of the
# border and freed on the other would crash.
target_compile_definitions(debulk::pcl INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)

debulk_imported(ipopt HEADER IpTNLP.hpp INCLUDE_SUFFIXES coin LIBRARIES ipopt)
target_compile_definitions(debulk::ipopt INTERFACE HAVE_CSTDDEF)

debulk_imported(nlopt HEADER nlopt.h LIBRARIES nlopt)
