# delassus_add_solver_plugin(NAME SOURCES file... [LIBRARIES target...] [PRIVATE_OPTIONS flag...])
#
# Builds the solver plugin NAME as NAME.so, with NAME.json beside it: the sidecar by which the plugin is listed without
# being loaded. In this tree both go to the plugin folder; in a project of its own, to that project's binary folder,
# and DELASSUS_PLUGIN_PATH or --plugin-path tells the host where that is. Installed, both go to the folder of plugins below
# the prefix: there the host finds them if the prefix is its own.
set(DELASSUS_PLUGIN_EXPORTS "${CMAKE_CURRENT_LIST_DIR}/delassus_plugin.map")

function(delassus_add_solver_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBRARIES;PRIVATE_OPTIONS")
  if(NOT arg_SOURCES)
    message(FATAL_ERROR "delassus_add_solver_plugin(${name}): SOURCES is missing")
  endif()
  add_library(${name} MODULE ${arg_SOURCES})
  if(CMAKE_CXX_COMPILER_LOADED)
    target_link_libraries(${name} PRIVATE delassus::sdk)
    target_compile_features(${name} PRIVATE cxx_std_20)
  else()  # plain C by delassus/plugin.h alone
    target_include_directories(${name} PRIVATE $<TARGET_PROPERTY:delassus::sdk,INTERFACE_INCLUDE_DIRECTORIES>)
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES})
  target_compile_options(${name} PRIVATE ${arg_PRIVATE_OPTIONS})
  # The entry point is the only symbol that leaves the library, templates of the standard library included.
  target_link_options(${name} PRIVATE "LINKER:--version-script=${DELASSUS_PLUGIN_EXPORTS}")
  set_target_properties(${name} PROPERTIES PREFIX "" C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON)
  if(DELASSUS_PLUGIN_DIRECTORY)
    target_link_libraries(${name} PRIVATE delassus_settings delassus_plugin_sdk_functions)
    set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${DELASSUS_PLUGIN_DIRECTORY}")
    if(DELASSUS_NATIVE_PLUGINS)
      target_compile_options(${name} PRIVATE -march=native)
    endif()
    set_property(GLOBAL APPEND PROPERTY DELASSUS_PLUGINS_BUILT ${name})
    set(component COMPONENT plugins)
  endif()
  if(DELASSUS_PLUGIN_DESTINATION)
    install(TARGETS ${name} LIBRARY DESTINATION ${DELASSUS_PLUGIN_DESTINATION} ${component})
    install(FILES "$<TARGET_FILE_DIR:${name}>/$<TARGET_FILE_BASE_NAME:${name}>.json"
            DESTINATION ${DELASSUS_PLUGIN_DESTINATION} ${component})
  endif()
  if(DELASSUS_PREFIX)
    install(CODE "if(NOT CMAKE_INSTALL_PREFIX STREQUAL \"${DELASSUS_PREFIX}\")
      message(STATUS \"Not Delassus' own prefix: export DELASSUS_PLUGIN_PATH=\${CMAKE_INSTALL_PREFIX}/${DELASSUS_PLUGIN_DESTINATION}\")
    endif()")
  endif()
  add_custom_command(TARGET ${name} POST_BUILD
    COMMAND delassus::command plugins describe "$<TARGET_FILE:${name}>" --sidecar
    VERBATIM)
endfunction()
