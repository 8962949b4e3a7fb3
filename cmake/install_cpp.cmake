# The C++ libraries and their headers as a CMake package (component cpp): find_package(debulk), then debulk::verdict or any
# other room. The wheel holds none of it.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/debulk)
install(TARGETS debulk_options EXPORT debulk COMPONENT cpp)
install(EXPORT debulk NAMESPACE debulk:: DESTINATION ${package_dir} FILE debulkTargets.cmake COMPONENT cpp)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/cpp/debulk DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT cpp
        FILES_MATCHING PATTERN "*.hpp")
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/debulkConfig.cmake.in ${PROJECT_BINARY_DIR}/debulkConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may change what a program calls.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/debulkConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/debulkConfig.cmake ${PROJECT_BINARY_DIR}/debulkConfigVersion.cmake
        DESTINATION ${package_dir} COMPONENT cpp)
