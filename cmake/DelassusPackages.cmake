# Debian packages: `cpack` in the build folder makes one for each component of DelassusInstall.cmake.
#   libdelassus       the libraries, with the modules that they load at need
#   delassus-plugins  the solvers
#   delassus-importers  readers of models in MJCF, URDF and SDF, where one is built
#   delassus          the command, with the pages and the suites
#   python3-delassus  the Python package, where it is built
#   libdelassus-dev   headers, SDK, CMake package, pkg-config, documentation, examples
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_DIRECTORY "${PROJECT_BINARY_DIR}/packages")
# example.org takes no mail: who publishes packages gives -DCPACK_PACKAGE_CONTACT="Name <address>".
set(CPACK_PACKAGE_CONTACT "Delassus maintainers <delassus@example.org>" CACHE STRING
    "Maintainer of the Debian packages: Name <address>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL library plugins command development)
if(TARGET delassus_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
if(TARGET delassus_import_mjcf OR TARGET delassus_import_urdf OR TARGET delassus_import_sdf)
  list(APPEND CPACK_COMPONENTS_ALL importers)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each component says its own
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}")
set(CPACK_POST_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/DelassusInstalledSize.cmake")
set(same_version "(= ${PROJECT_VERSION})")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libdelassus)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS libmetis5)  # opened at run time, so dpkg-shlibdeps does not see it
set(CPACK_DEBIAN_LIBRARY_PACKAGE_RECOMMENDS delassus-plugins)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "Saddle-point and cone-complementarity problems: the library
Delassus solves the problems that constrained mechanics poses, such as those of joints and frictional
contacts, by solvers that are plugins, and simulates the scenes that they come from.")

set(CPACK_DEBIAN_PLUGINS_PACKAGE_NAME delassus-plugins)
set(CPACK_DEBIAN_PLUGINS_PACKAGE_SECTION math)
set(CPACK_DEBIAN_PLUGINS_PACKAGE_DEPENDS "libdelassus ${same_version}")
set(CPACK_COMPONENT_PLUGINS_DESCRIPTION "Saddle-point and cone-complementarity problems: the solvers
First-order, interior-point, semismooth Newton, Krylov and direct solvers for Delassus.")

set(CPACK_DEBIAN_IMPORTERS_PACKAGE_NAME delassus-importers)
set(CPACK_DEBIAN_IMPORTERS_PACKAGE_SECTION math)
set(CPACK_DEBIAN_IMPORTERS_PACKAGE_DEPENDS "libdelassus ${same_version}")
set(CPACK_COMPONENT_IMPORTERS_DESCRIPTION "Saddle-point and cone-complementarity problems: models of other programs
Reads models of robots in MJCF, URDF and SDF, of which Delassus makes scenes.")

set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME delassus)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SECTION math)
set(CPACK_DEBIAN_COMMAND_PACKAGE_DEPENDS "libdelassus ${same_version}")
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS delassus-plugins)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS delassus-importers)
set(CPACK_COMPONENT_COMMAND_DESCRIPTION "Saddle-point and cone-complementarity problems: the command
Solves problems, compares and benchmarks solvers and timesteppers, and simulates scenes.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libdelassus-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libdelassus ${same_version}, delassus ${same_version}, libeigen3-dev (>= 3.4)")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Saddle-point and cone-complementarity problems: development files
Headers, documentation and examples for programs that embed Delassus and for authors of solvers.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-delassus)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "libdelassus ${same_version}, ${DELASSUS_PYTHON_VERSIONS}, python3-numpy, python3-scipy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "delassus-plugins, delassus")  # the latter for bench() and the pages
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Saddle-point and cone-complementarity problems: the Python package
Solves problems of NumPy arrays and SciPy matrices with the solvers of Delassus, and simulates scenes.")

# /usr/share/doc/<package>/copyright, in the packages only.
file(READ LICENSE licence)
string(STRIP "${licence}" licence)
string(REPLACE "\n\n" "\n.\n" licence "${licence}")
string(REPLACE "\n" "\n " licence " ${licence}")
configure_file(cmake/copyright.in copyright @ONLY)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  install(FILES "${PROJECT_BINARY_DIR}/copyright" DESTINATION share/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME}
          COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()

include(CPack)
