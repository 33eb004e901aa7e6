# Headers compiled once: viscera_precompiled for libraries, viscera_precompiled_test for test
# programs, as position-independent executables and libraries can't share them. The headers are
# named as an #include names them, so that checkouts in different folders share a cache of ccache.

# viscera_precompiled_targets(): lets every target below the current folder reuse them that is
# compiled with the project's options.
function(viscera_precompiled_targets)
  if(NOT VISCERA_PRECOMPILED_HEADERS)
    return()
  endif()
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/precompiled.cpp" CONTENT "")
  add_library(viscera_precompiled STATIC "${PROJECT_BINARY_DIR}/precompiled.cpp")
  target_link_libraries(viscera_precompiled PRIVATE viscera_base)
  target_precompile_headers(viscera_precompiled PRIVATE
    [["tools/cmake/precompiled.h"]])
  if(VISCERA_TESTS)
    add_executable(viscera_precompiled_test "${PROJECT_BINARY_DIR}/precompiled.cpp")
    target_link_libraries(viscera_precompiled_test PRIVATE viscera_base GTest::gtest_main)
    target_precompile_headers(viscera_precompiled_test PRIVATE
      [["tools/cmake/precompiled_test.h"]])
  endif()
  viscera_precompiled_folder("${PROJECT_SOURCE_DIR}")
endfunction()

function(viscera_precompiled_folder folder)
  get_property(targets DIRECTORY "${folder}" PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    get_target_property(libraries ${target} LINK_LIBRARIES)
    if(target MATCHES "^viscera_precompiled")
      continue()
    elseif(type STREQUAL "STATIC_LIBRARY" AND libraries MATCHES "viscera_")
      target_precompile_headers(${target} REUSE_FROM viscera_precompiled)
    elseif(type STREQUAL "EXECUTABLE" AND libraries MATCHES "GTest::gtest_main")
      target_precompile_headers(${target} REUSE_FROM viscera_precompiled_test)
    endif()
  endforeach()
  get_property(subfolders DIRECTORY "${folder}" PROPERTY SUBDIRECTORIES)
  foreach(subfolder IN LISTS subfolders)
    viscera_precompiled_folder("${subfolder}")
  endforeach()
endfunction()
