# Labels of the tests that GoogleTest's programs hold; ctest reads this file after it has listed them. Tests that are not
# GoogleTest get theirs where they are added. CONTRIBUTING.md has the meaning of each label.
#   fast       neither slow nor browser nor package
#   slow       measured: tests/slow.txt, which scripts/measure-tests writes
#   processes  starts processes of its own
#   mpi        loads PETSc, MUMPS or MPI into the test's own process, or starts it under mpirun
#   browser    draws a page in Chromium
#   orders     measures an order of convergence: many steps of code that other tests run too
set(processes_tests "^(bench|check|command|faults|import|relations)[.]")
set(mpi_tests "^(allocation|partitioned)[.]|Petsc|Mumps|ExampleScene|MeshFile|TrapezoidalRuleWithAJoint|Equilibrium")
set(orders_tests "[.](IsTheOneClaimed|HasTheOrderClaimed)/")
set(browser_tests "^bench[.](ReportTest|BenchReport)[.]|^command[.]View(Played|Browsed)[.]")

file(STRINGS "${CMAKE_CURRENT_LIST_DIR}/slow.txt" slow_tests REGEX "^[^#]")

foreach(folder IN LISTS DELASSUS_TEST_FOLDERS)
  foreach(test IN LISTS "${folder}_tests")
    string(REGEX REPLACE "(/[0-9]+)+$" "" case "${test}")
    set(labels "")
    foreach(label processes mpi browser orders)
      if(test MATCHES "${${label}_tests}")
        list(APPEND labels ${label})
      endif()
    endforeach()
    list(FIND slow_tests "${case}" place)
    if(NOT place EQUAL -1)
      list(APPEND labels slow)
    elseif(NOT test MATCHES "${browser_tests}")
      list(APPEND labels fast)
    endif()
    set_tests_properties("${test}" PROPERTIES LABELS "${labels}")
  endforeach()
endforeach()
