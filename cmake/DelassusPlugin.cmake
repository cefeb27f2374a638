# delassus_add_solver_plugin(NAME SOURCES file... [LIBRARIES target...] [PRIVATE_OPTIONS flag...])
#
# Builds the solver plugin NAME as NAME.so, with NAME.json beside it: the sidecar by which the plugin is listed without
# being loaded. In this tree both go to the plugin folder; in a project of its own, to that project's binary folder,
# and DELASSUS_PLUGIN_PATH or --plugin-path tells the host where that is.
set(DELASSUS_PLUGIN_EXPORTS "${CMAKE_CURRENT_LIST_DIR}/delassus_plugin.map")

function(delassus_add_solver_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBRARIES;PRIVATE_OPTIONS")
  if(NOT arg_SOURCES)
    message(FATAL_ERROR "delassus_add_solver_plugin(${name}): SOURCES is missing")
  endif()
  add_library(${name} MODULE ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE delassus::sdk ${arg_LIBRARIES})
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_compile_options(${name} PRIVATE ${arg_PRIVATE_OPTIONS})
  # The entry point is the only symbol that leaves the library, templates of the standard library included.
  target_link_options(${name} PRIVATE "LINKER:--version-script=${DELASSUS_PLUGIN_EXPORTS}")
  set_target_properties(${name} PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  if(DELASSUS_PLUGIN_DIRECTORY)
    target_link_libraries(${name} PRIVATE delassus_settings delassus_plugin_sdk_functions)
    set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${DELASSUS_PLUGIN_DIRECTORY}")
    if(DELASSUS_NATIVE_PLUGINS)
      target_compile_options(${name} PRIVATE -march=native)
    endif()
    install(TARGETS ${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/delassus/plugins COMPONENT plugins)
    install(FILES "${DELASSUS_PLUGIN_DIRECTORY}/${name}.json"
            DESTINATION ${CMAKE_INSTALL_LIBDIR}/delassus/plugins COMPONENT plugins)
    set_property(GLOBAL APPEND PROPERTY DELASSUS_PLUGINS_BUILT ${name})
  endif()
  add_custom_command(TARGET ${name} POST_BUILD
    COMMAND delassus::command plugins describe "$<TARGET_FILE:${name}>" --sidecar
    VERBATIM)
endfunction()
