# Target `coverage` (preset of that name): runs tests that are built, and prints which share of the lines and branches they
# reach, by module and in total, by gcovr. DELASSUS_COVERAGE_TESTS restricts the tests; build their targets first, or
# everything.
if(NOT DELASSUS_COVERAGE)
  return()
endif()
find_program(GCOVR_PROGRAM gcovr REQUIRED)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(DELASSUS_COVERAGE_TESTS "." CACHE STRING "Regular expression of the tests that the target coverage runs")
set(folder "${PROJECT_BINARY_DIR}/coverage")
file(MAKE_DIRECTORY "${folder}")
add_custom_target(coverage
  COMMAND "${CMAKE_COMMAND}" -E echo "Tests: ${DELASSUS_COVERAGE_TESTS}"
  # Counts add up from run to run.
  COMMAND find "${PROJECT_BINARY_DIR}" -name "*.gcda" -delete
  COMMAND "${CMAKE_CTEST_COMMAND}" --test-dir "${PROJECT_BINARY_DIR}" -R "${DELASSUS_COVERAGE_TESTS}" -j2 --output-on-failure
          --no-tests=error
  # Branches of exceptions that may pass through any call say nothing about the tests.
  COMMAND "${GCOVR_PROGRAM}" -j2 --root "${PROJECT_SOURCE_DIR}" --filter "(core|integrators|plugins|tools)/"
          --exclude-throw-branches --json "${folder}/gcovr.json" "${PROJECT_BINARY_DIR}"
  COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/scripts/coverage-by-module" "${folder}/gcovr.json"
          "${folder}/merged.json"
  COMMAND "${GCOVR_PROGRAM}" --root "${PROJECT_SOURCE_DIR}" --add-tracefile "${folder}/merged.json"
          --html-details "${folder}/index.html"
  COMMAND "${CMAKE_COMMAND}" -E echo "Line by line: ${folder}/index.html"
  WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
  USES_TERMINAL VERBATIM)
