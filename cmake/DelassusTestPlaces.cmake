# delassus_test_places(TARGET [DEFINITION...]): links TARGET with support/places.cpp, a library TARGET_places.
function(delassus_test_places target)
  add_library(${target}_places OBJECT "${PROJECT_SOURCE_DIR}/tests/support/places.cpp")
  target_include_directories(${target}_places PRIVATE "${PROJECT_SOURCE_DIR}/tests")
  target_compile_definitions(${target}_places PRIVATE
    DELASSUS_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    DELASSUS_SHARED_PROBLEMS_DEFAULT="${PROJECT_SOURCE_DIR}/../shared/problems"
    DELASSUS_COMMAND="$<TARGET_FILE:delassus_command>" ${ARGN})
  target_link_libraries(${target} PRIVATE ${target}_places)
endfunction()
