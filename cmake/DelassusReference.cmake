# Target `reference`: the API reference by Doxygen from the comments of the public headers, in reference/html of the build
# folder. A warning of Doxygen is an error.
find_program(DOXYGEN_PROGRAM doxygen)
find_program(AWK_PROGRAM NAMES mawk gawk awk)
if(NOT DOXYGEN_PROGRAM OR NOT AWK_PROGRAM)
  message(STATUS "Doxygen or awk not found: no target `reference`")
  return()
endif()
set(DELASSUS_REFERENCE_DIRECTORY "${PROJECT_BINARY_DIR}/reference")
configure_file(docs/Doxyfile.in "${DELASSUS_REFERENCE_DIRECTORY}/Doxyfile" @ONLY)
add_custom_target(reference
  COMMAND "${DOXYGEN_PROGRAM}" "${DELASSUS_REFERENCE_DIRECTORY}/Doxyfile"
  COMMAND "${CMAKE_COMMAND}" -E echo "${DELASSUS_REFERENCE_DIRECTORY}/html/index.html"
  WORKING_DIRECTORY "${DELASSUS_REFERENCE_DIRECTORY}"
  VERBATIM)
