# Run by CPack after it has made the Debian packages: sets Installed-Size as Debian's policy defines it, each file and each
# link rounded up to 1 KiB and 1 KiB for a folder. CPack itself counts a link as the file that it leads to, and so each
# shared library two or three times.
foreach(package IN LISTS CPACK_PACKAGE_FILES)
  if(NOT package MATCHES "[.]deb$")
    continue()
  endif()
  execute_process(COMMAND dpkg-deb --contents "${package}" OUTPUT_VARIABLE contents COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[^\n]+" lines "${contents}")
  list(FILTER lines EXCLUDE REGEX " [.]/$")
  set(size 1)  # the root, which CPack leaves out and dpkg-deb puts in
  foreach(line IN LISTS lines)
    if(line MATCHES "^-[^ ]+ +[^ ]+ +([0-9]+) ")
      math(EXPR size "${size} + (${CMAKE_MATCH_1} + 1023) / 1024")
    else()
      math(EXPR size "${size} + 1")
    endif()
  endforeach()

  set(folder "${package}.unpacked")
  file(REMOVE_RECURSE "${folder}")
  execute_process(COMMAND dpkg-deb --raw-extract "${package}" "${folder}" COMMAND_ERROR_IS_FATAL ANY)
  file(READ "${folder}/DEBIAN/control" control)
  string(REGEX REPLACE "Installed-Size: [0-9]+" "Installed-Size: ${size}" control "${control}")
  file(WRITE "${folder}/DEBIAN/control" "${control}")
  execute_process(COMMAND dpkg-deb --root-owner-group -Zxz --build "${folder}" "${package}" OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  file(REMOVE_RECURSE "${folder}")
endforeach()
