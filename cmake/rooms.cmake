# A room is a static library debulk_<name> from the sources in cpp/debulk/<name>, and may use only rooms before it
# (tests/python/test_rooms.py reads the #include lines and fails on any other arrow).
function(debulk_room name)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES;LINKS" ${ARGN})
  add_library(debulk_${name} STATIC ${ARG_SOURCES})
  target_link_libraries(debulk_${name} PUBLIC debulk_options Eigen3::Eigen PRIVATE ${ARG_LINKS})
  foreach(room ${ARG_USES})
    target_link_libraries(debulk_${name} PUBLIC debulk_${room})
  endforeach()
  set_target_properties(debulk_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS debulk_${name} EXPORT debulk ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT cpp)
endfunction()

# One test executable a room.
function(debulk_room_test room)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES" ${ARGN})
  add_executable(test_${room} ${ARG_SOURCES})
  target_include_directories(test_${room} PRIVATE ${PROJECT_SOURCE_DIR}/tests/cpp)
  target_link_libraries(test_${room} PRIVATE debulk_${room} GTest::gtest_main)
  foreach(other ${ARG_USES})
    target_link_libraries(test_${room} PRIVATE debulk_${other})
  endforeach()
  gtest_discover_tests(test_${room} TEST_PREFIX "${room}." DISCOVERY_TIMEOUT 60)
endfunction()
