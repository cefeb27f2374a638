# What is installed, and the target `product` that builds it. Each rule names its component, which is one Debian package
# (DelassusPackages.cmake): library, plugins, command, development.
# find_package(delassus) gives delassus::delassus and the command; COMPONENTS SDK gives delassus::sdk (headers and Eigen
# alone) and delassus_add_solver_plugin().
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY DELASSUS_LOADED_MODULES)
get_property(plugins GLOBAL PROPERTY DELASSUS_PLUGINS_BUILT)
add_custom_target(product)
add_dependencies(product delassus_command delassus_documents delassus_pages ${modules} ${plugins})

install(TARGETS delassus_command EXPORT delassusSdkTargets RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
# The suites of `delassus bench`, with what they name; they are found beside libdelassus, in the build tree too.
file(CREATE_LINK "${PROJECT_SOURCE_DIR}/examples" "${DELASSUS_MODULE_DIRECTORY}/examples" SYMBOLIC)
install(DIRECTORY examples/suites examples/problems examples/scenes examples/models DESTINATION ${CMAKE_INSTALL_LIBDIR}/delassus/examples
        COMPONENT command)
install(FILES docs/scene.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/delassus COMPONENT command)
install(FILES "${DELASSUS_PLUGIN_DIRECTORY}/not-built.list" DESTINATION ${CMAKE_INSTALL_LIBDIR}/delassus/plugins
        COMPONENT plugins)

install(TARGETS delassus_sdk EXPORT delassusSdkTargets)
install(DIRECTORY core/include/delassus DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(FILES "${PROJECT_BINARY_DIR}/core/generated/delassus/version.hpp" tools/generate/include/delassus/generate.hpp
  tools/generate/include/delassus/generate_partitioned.hpp
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/delassus COMPONENT development)
install(DIRECTORY examples/plugin examples/plugin-c examples/plugin-rust examples/embed examples/system examples/engines examples/dump DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT development)
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development
        FILES_MATCHING PATTERN "*.md" PATTERN "*.svg")

set(package_directory ${CMAKE_INSTALL_LIBDIR}/cmake/delassus)
install(EXPORT delassusSdkTargets NAMESPACE delassus:: DESTINATION ${package_directory} COMPONENT development)
install(EXPORT delassusCoreTargets NAMESPACE delassus:: DESTINATION ${package_directory} COMPONENT development)
configure_package_config_file(cmake/delassusConfig.cmake.in delassusConfig.cmake
                              INSTALL_DESTINATION ${package_directory})
write_basic_package_version_file(delassusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/delassusConfig.cmake" "${PROJECT_BINARY_DIR}/delassusConfigVersion.cmake"
              cmake/DelassusPlugin.cmake cmake/delassus_plugin.map
        DESTINATION ${package_directory} COMPONENT development)

# pkg-config: delassus.pc for delassus::delassus, delassus-sdk.pc for delassus::sdk, delassus-<module>.pc for each other library.
# They find their folders from their own place, so that an install tree can be moved.
set(pkgconfig_directory ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH pkgconfig_to_prefix "/prefix/${pkgconfig_directory}" /prefix)
string(REGEX REPLACE "/$" "" pkgconfig_to_prefix "${pkgconfig_to_prefix}")

# delassus_pkgconfig(<name> <what> <requires> <libs>)
function(delassus_pkgconfig pc_name pc_what pc_requires pc_libs)
  configure_file(cmake/delassus.pc.in "${PROJECT_BINARY_DIR}/${pc_name}.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/${pc_name}.pc" DESTINATION ${pkgconfig_directory} COMPONENT development)
endfunction()

delassus_pkgconfig(delassus-sdk "headers for authors of solvers" "eigen3 >= 3.4" "")
get_property(libraries GLOBAL PROPERTY DELASSUS_LIBRARIES)
foreach(library IN LISTS libraries)
  get_target_property(links ${library} INTERFACE_LINK_LIBRARIES)
  set(requires "")
  foreach(other IN LISTS links)
    if(other IN_LIST libraries)
      string(REPLACE "_" "-" other "${other}")
      list(APPEND requires "${other} = ${PROJECT_VERSION}")
    endif()
  endforeach()
  if(NOT requires)
    set(requires "eigen3 >= 3.4")  # the headers of the SDK lie in the same folder
  endif()
  list(JOIN requires ", " requires)
  string(REPLACE "_" "-" name "${library}")
  delassus_pkgconfig(${name} "lib${library}" "${requires}" "-L\${libdir} -l${library}")
endforeach()
