# Solves serially, keeping the answers in a file; then with two processes, which compare theirs with it.
set(answers "${FOLDER}/${PLUGIN}-serial.bin")
execute_process(COMMAND "${PROGRAM}" ${PLUGIN} write "${answers}" RESULT_VARIABLE result TIMEOUT 120)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "the serial run of ${PLUGIN} failed: ${result}")
endif()
execute_process(COMMAND "${MPIEXEC}" -n 2 --oversubscribe "${PROGRAM}" ${PLUGIN} compare "${answers}"
                RESULT_VARIABLE result OUTPUT_VARIABLE output TIMEOUT 150)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "two processes of ${PLUGIN} failed: ${result}")
endif()
if(NOT output STREQUAL "")
  message(FATAL_ERROR "${PLUGIN} wrote to the standard output: ${output}")
endif()
