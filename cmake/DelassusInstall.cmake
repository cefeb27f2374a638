# The installed package: find_package(delassus) gives delassus::delassus and the command; COMPONENTS SDK gives
# delassus::sdk (headers and Eigen alone) and delassus_add_solver_plugin().
include(CMakePackageConfigHelpers)

set(package_directory ${CMAKE_INSTALL_LIBDIR}/cmake/delassus)

install(TARGETS delassus_sdk EXPORT delassusSdkTargets)
install(TARGETS delassus_command EXPORT delassusSdkTargets RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY "${PROJECT_SOURCE_DIR}/core/include/delassus" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES "${PROJECT_BINARY_DIR}/core/generated/delassus/version.hpp" "${PROJECT_SOURCE_DIR}/tools/generate/include/delassus/generate.hpp"
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/delassus)
install(EXPORT delassusSdkTargets NAMESPACE delassus:: DESTINATION ${package_directory})
install(EXPORT delassusCoreTargets NAMESPACE delassus:: DESTINATION ${package_directory})
install(FILES "${DELASSUS_PLUGIN_DIRECTORY}/not-built.list" DESTINATION ${CMAKE_INSTALL_LIBDIR}/delassus/plugins)
# The suites of `delassus bench`, with what they name; they are found beside libdelassus, in the build tree too.
file(CREATE_LINK "${PROJECT_SOURCE_DIR}/examples" "${DELASSUS_MODULE_DIRECTORY}/examples" SYMBOLIC)
install(DIRECTORY examples/suites examples/problems examples/scenes DESTINATION ${CMAKE_INSTALL_LIBDIR}/delassus/examples COMPONENT command)
install(FILES "${PROJECT_SOURCE_DIR}/docs/scene.schema.json" DESTINATION ${CMAKE_INSTALL_DATADIR}/delassus)
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(cmake/delassusConfig.cmake.in delassusConfig.cmake
                              INSTALL_DESTINATION ${package_directory})
write_basic_package_version_file(delassusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/delassusConfig.cmake" "${PROJECT_BINARY_DIR}/delassusConfigVersion.cmake"
              "${PROJECT_SOURCE_DIR}/cmake/DelassusPlugin.cmake" "${PROJECT_SOURCE_DIR}/cmake/delassus_plugin.map"
        DESTINATION ${package_directory})

configure_file(cmake/delassus.pc.in delassus.pc @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/delassus.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
