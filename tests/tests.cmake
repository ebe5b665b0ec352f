# Everything that ctest runs. A test executable a file: tests/test_X.c (CMocka), tests/oracle_X.cpp (against LEMON, where it is
# installed), examples/X.c (run as they are), fuzz/X.c (its corpus replayed).
enable_testing()
set(QW_ROOT ${CMAKE_CURRENT_SOURCE_DIR})

# Entry points under libFuzzer with QW_FUZZ; else with a main that replays files.
file(GLOB fuzzers CONFIGURE_DEPENDS fuzz/fuzz_*.c)
foreach(source ${fuzzers})
  get_filename_component(name ${source} NAME_WE)
  if(QW_FUZZ)
    add_executable(${name} ${source})
    target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  else()
    add_executable(${name} ${source} fuzz/replay.c)
    set(inputs ${QW_ROOT}/fuzz/corpus/${name} ${QW_ROOT}/fuzz/corpus/fuzz_load ${QW_ROOT}/tests/data/io ${QW_ROOT}/tests/data/regress)
    if(name STREQUAL fuzz_remesh AND QW_SANITIZE STREQUAL "thread") # a whole run a cut: here those of its own corpus must do
      set(inputs ${QW_ROOT}/fuzz/corpus/${name})
    endif()
    add_test(NAME ${name} COMMAND ${name} ${inputs})
  endif()
  target_link_libraries(${name} PRIVATE quadwright_static)
  target_include_directories(${name} PRIVATE src)
endforeach()
if(QW_FUZZ)
  return()
endif()

find_library(CMOCKA_LIBRARY cmocka REQUIRED)
# Tests that reach into the command line tool name the files they need.
set(test_render_needs cli/render.c cli/raster.c cli/png.c cli/letters.c cli/scene.c cli/view.c)
set(test_cli_needs cli/json.c cli/summary.c)

function(qw_add_unit source)
  get_filename_component(name ${source} NAME_WE)
  add_executable(${name} ${source} ${${name}_needs})
  target_link_libraries(${name} PRIVATE quadwright_static ${CMOCKA_LIBRARY})
  target_include_directories(${name} PRIVATE src tests cli)
  target_include_directories(${name} SYSTEM PRIVATE ${STB_INCLUDE})
  target_compile_definitions(${name} PRIVATE QW_TEST_DATA="${QW_ROOT}/tests/data" QW_BINARY_DIR="${CMAKE_CURRENT_BINARY_DIR}"
    QW_SOURCE_DIR="${QW_ROOT}")
  add_test(NAME ${name} COMMAND ${name})
endfunction()

file(GLOB units CONFIGURE_DEPENDS tests/test_*.c)
foreach(source ${units})
  qw_add_unit(${source})
endforeach()
if(TARGET test_cli)
  add_dependencies(test_cli quadwright quadwright-shapes)
endif()

find_path(LEMON_INCLUDE lemon/list_graph.h)
file(GLOB oracles CONFIGURE_DEPENDS tests/oracle_*.cpp)
if(LEMON_INCLUDE)
  foreach(source ${oracles})
    qw_add_unit(${source})
  endforeach()
endif()

file(GLOB examples CONFIGURE_DEPENDS examples/*.c)
foreach(source ${examples})
  get_filename_component(name ${source} NAME_WE)
  add_executable(example_${name} ${source})
  target_link_libraries(example_${name} PRIVATE $<IF:$<BOOL:${QW_BUILD_SHARED}>,quadwright_shared,quadwright_static> m)
  add_test(NAME example_${name} COMMAND example_${name})
endforeach()

# Scripts. Each says what it found wrong.
add_test(NAME layers COMMAND ${QW_ROOT}/tools/check-layers ${QW_ROOT})
add_test(NAME format COMMAND ${QW_ROOT}/tools/check-format ${QW_ROOT})
set_tests_properties(format PROPERTIES SKIP_RETURN_CODE 77)
add_test(NAME documents COMMAND ${CMAKE_COMMAND} -DROOT=${QW_ROOT} -DTOOL=$<TARGET_FILE:quadwright> -P ${QW_ROOT}/tests/documents.cmake)
add_test(NAME shapes COMMAND ${CMAKE_COMMAND} -DSHAPES=$<TARGET_FILE:quadwright-shapes> -DTOOL=$<TARGET_FILE:quadwright>
  -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-shapes -P ${QW_ROOT}/tests/shapes.cmake)
if(QW_BUILD_SHARED AND NOT QW_COVERAGE)
  add_test(NAME symbols COMMAND ${CMAKE_COMMAND} -DNM=${CMAKE_NM} -DLIBRARY=$<TARGET_FILE:quadwright_shared>
    -DHEADER=${QW_ROOT}/include/quadwright/quadwright.h -P ${QW_ROOT}/tests/symbols.cmake)
endif()
if(QW_BUILD_SHARED AND NOT QW_SANITIZE AND NOT QW_COVERAGE)
  add_test(NAME install COMMAND ${CMAKE_COMMAND} -DBUILD=${CMAKE_CURRENT_BINARY_DIR} -DSOURCE=${QW_ROOT}/tests/consumer
    -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-install -DCC=${CMAKE_C_COMPILER} -DLIBDIR=${CMAKE_INSTALL_LIBDIR} -P ${QW_ROOT}/tests/install.cmake)
endif()
