# The target delassus_cholmod for the plugins with sparse Cholesky factors: CHOLMOD of SuiteSparse, any version that has
# cholmod_solve2 (since 2.1). Not made where it is absent.
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse)
find_library(CHOLMOD_LIBRARY cholmod)
mark_as_advanced(CHOLMOD_INCLUDE_DIR CHOLMOD_LIBRARY)
delassus_dependency(cholmod CHOLMOD_INCLUDE_DIR CHOLMOD_LIBRARY)
if(DELASSUS_HAS_cholmod AND NOT TARGET delassus_cholmod)
  add_library(delassus_cholmod INTERFACE)
  target_include_directories(delassus_cholmod SYSTEM INTERFACE ${CHOLMOD_INCLUDE_DIR})
  target_link_libraries(delassus_cholmod INTERFACE ${CHOLMOD_LIBRARY})
endif()
