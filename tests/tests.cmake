# Everything that ctest runs: the suites of tests/suites.def (CMocka), and an executable a file of tests/oracle_X.cpp (against LEMON,
# where it is installed), examples/X.c (run as they are), fuzz/X.c (its corpus replayed).
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
    # To edits of dumps, options, cells and soups any bytes are some, and each is a run: fuzz_remesh gets files of other formats in
    # `make test-long` only, under AddressSanitizer.
    if(name STREQUAL fuzz_dump OR name STREQUAL fuzz_steer OR name STREQUAL fuzz_wrap OR (name STREQUAL fuzz_remesh AND NOT QW_SANITIZE MATCHES "address"))
      set(inputs ${QW_ROOT}/fuzz/corpus/${name})
    endif()
    add_test(NAME ${name} COMMAND ${name} ${inputs})
  endif()
  target_link_libraries(${name} PRIVATE quadwright_static)
  target_include_directories(${name} PRIVATE src tests)
endforeach()
if(QW_FUZZ)
  return()
endif()

find_library(CMOCKA_LIBRARY cmocka REQUIRED)
# The suites of tests/suites.def in one program, one test a suite. Sanitized ones take up to ten times as long.
file(GLOB units CONFIGURE_DEPENDS tests/test_*.c)
add_executable(quadwright-tests tests/suites.c ${units} cli/summary.c)
target_link_libraries(quadwright-tests PRIVATE quadwright_static ${CMOCKA_LIBRARY})
target_include_directories(quadwright-tests PRIVATE src tests cli)
if(GLPK_INCLUDE AND GLPK_LIBRARY) # an oracle, whether or not the library uses it
  target_compile_definitions(quadwright-tests PRIVATE QW_HAVE_GLPK)
  target_include_directories(quadwright-tests SYSTEM PRIVATE ${GLPK_INCLUDE})
  target_link_libraries(quadwright-tests PRIVATE ${GLPK_LIBRARY})
endif()
target_compile_definitions(quadwright-tests PRIVATE QW_TEST_DATA="${QW_ROOT}/tests/data" QW_BINARY_DIR="${CMAKE_CURRENT_BINARY_DIR}"
  QW_SOURCE_DIR="${QW_ROOT}")
add_dependencies(quadwright-tests quadwright quadwright-shapes quadwright-painted)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${QW_ROOT}/tests/suites.def)
set(slower 1)
if(QW_SANITIZE OR QW_COVERAGE)
  set(slower 10)
endif()
file(STRINGS tests/suites.def rows REGEX "^SUITE")
foreach(row IN LISTS rows)
  string(REGEX MATCH "SUITE\\(([a-z_0-9]+), \"([a-z;]+)\", ([0-9]+)\\)" matched "${row}")
  if(NOT matched)
    message(FATAL_ERROR "tests/suites.def: not a row: ${row}")
  endif()
  set(suite ${CMAKE_MATCH_1})
  set(labels ${CMAKE_MATCH_2})
  math(EXPR limit "${CMAKE_MATCH_3} * ${slower}")
  add_test(NAME ${suite} COMMAND quadwright-tests ${suite})
  set_tests_properties(${suite} PROPERTIES LABELS "${labels}" TIMEOUT ${limit} COST ${CMAKE_MATCH_3}) # the long ones first
  if(NOT QW_SANITIZE MATCHES "thread") # one thread where a test asks for no more: several, side by side, would wait for one another
    set_tests_properties(${suite} PROPERTIES PROCESSOR_AFFINITY ON)
  endif()
endforeach()
if(QW_SANITIZE) # half an hour together: `make test-long`
  set_tests_properties(batch promise torture protrusions regress fuzz_remesh PROPERTIES LABELS "run;thread;long")
endif()

find_path(LEMON_INCLUDE lemon/list_graph.h)
file(GLOB oracles CONFIGURE_DEPENDS tests/oracle_*.cpp)
if(LEMON_INCLUDE)
  foreach(source ${oracles})
    get_filename_component(name ${source} NAME_WE)
    add_executable(${name} ${source})
    target_link_libraries(${name} PRIVATE quadwright_static)
    target_include_directories(${name} PRIVATE src)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS unit)
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
add_test(NAME packaging COMMAND sh -c "packaging/fill.py --check && packaging/check.py" WORKING_DIRECTORY ${QW_ROOT})
add_test(NAME documents COMMAND ${CMAKE_COMMAND} -DROOT=${QW_ROOT} -DTOOL=$<TARGET_FILE:quadwright>
  -DMANUAL=$<TARGET_FILE:quadwright-manual> -DSHAPES=$<TARGET_FILE:quadwright-shapes> -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-documents
  -P ${QW_ROOT}/tests/documents.cmake)
add_test(NAME guides COMMAND ${CMAKE_COMMAND} -DROOT=${QW_ROOT} -DTOOL=$<TARGET_FILE:quadwright> -DSHAPES=$<TARGET_FILE:quadwright-shapes>
  -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-guides -P ${QW_ROOT}/tests/guides.cmake)
set_tests_properties(guides PROPERTIES LABELS "run;long" COST 900 PROCESSOR_AFFINITY ON)
add_test(NAME completions COMMAND ${CMAKE_COMMAND} -DROOT=${QW_ROOT} -DWORK=${CMAKE_CURRENT_BINARY_DIR} -P ${QW_ROOT}/tests/completions.cmake)
add_test(NAME shapes COMMAND ${CMAKE_COMMAND} -DSHAPES=$<TARGET_FILE:quadwright-shapes> -DTOOL=$<TARGET_FILE:quadwright>
  -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-shapes -P ${QW_ROOT}/tests/shapes.cmake)
add_test(NAME elementary_only COMMAND ${CMAKE_COMMAND} -DNM=${CMAKE_NM} -DLIBRARY=$<TARGET_FILE:quadwright_static>
  -P ${QW_ROOT}/tests/elementary.cmake)
add_test(NAME golden COMMAND ${CMAKE_COMMAND} -DTOOL=$<TARGET_FILE:quadwright> -DSHAPES=$<TARGET_FILE:quadwright-shapes>
  -DROOT=${QW_ROOT} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-golden -DWITHOUT_SAT=$<NOT:$<BOOL:${QW_HAS_CADICAL}>> -P ${QW_ROOT}/tests/golden.cmake)
set_tests_properties(golden PROPERTIES LABELS run COST 300)
if(QW_BUILD_SHARED AND NOT QW_COVERAGE)
  add_test(NAME symbols COMMAND ${CMAKE_COMMAND} -DNM=${CMAKE_NM} -DLIBRARY=$<TARGET_FILE:quadwright_shared>
    -DHEADER=${QW_ROOT}/include/quadwright/quadwright.h -P ${QW_ROOT}/tests/symbols.cmake)
endif()
if(QW_BUILD_SHARED AND NOT QW_SANITIZE AND NOT QW_COVERAGE)
  add_test(NAME languages COMMAND ${CMAKE_COMMAND} -DROOT=${QW_ROOT} -DLIBRARIES=${CMAKE_CURRENT_BINARY_DIR}
    -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-languages -P ${QW_ROOT}/tests/languages.cmake)
  set_tests_properties(languages PROPERTIES SKIP_REGULAR_EXPRESSION "SKIPPED: ")
  add_test(NAME install COMMAND ${CMAKE_COMMAND} -DBUILD=${CMAKE_CURRENT_BINARY_DIR} -DSOURCE=${QW_ROOT}/tests/consumer
    -DROOT=${QW_ROOT} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/test-install -DCC=${CMAKE_C_COMPILER} -DLIBDIR=${CMAKE_INSTALL_LIBDIR} -P ${QW_ROOT}/tests/install.cmake)
endif()
