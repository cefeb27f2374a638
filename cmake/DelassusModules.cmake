# Modules. A module is a folder of sources, a target and an include path. The include path of <module> holds its folder
# under its own name ("problem/validate.hpp") and its public headers ("delassus/problem.hpp"), nothing else; whoever may
# use the module links <module>_headers. So an include against the layering (docs/architecture.md) does not compile.

# delassus_headers(<module> [FOLDER dir] [PUBLIC header…] [USES module…]): the include path of a module. FOLDER: where its
# sources are; the folder of that name here by default. PUBLIC: files for <delassus/…>. USES: the modules below it.
function(delassus_headers module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "FOLDER" "PUBLIC;USES")
  if(NOT arg_FOLDER)
    set(arg_FOLDER "${CMAKE_CURRENT_SOURCE_DIR}/${module}")
  endif()
  set(path "${PROJECT_BINARY_DIR}/include/${module}")
  file(REMOVE_RECURSE "${path}")
  file(MAKE_DIRECTORY "${path}/delassus")
  file(CREATE_LINK "${arg_FOLDER}" "${path}/${module}" SYMBOLIC)
  foreach(header IN LISTS arg_PUBLIC)
    get_filename_component(name "${header}" NAME)
    file(CREATE_LINK "${header}" "${path}/delassus/${name}" SYMBOLIC)
  endforeach()
  add_library(${module}_headers INTERFACE)
  set_target_properties(${module}_headers PROPERTIES DELASSUS_FOLDER "${arg_FOLDER}")
  target_include_directories(${module}_headers INTERFACE "${path}")
  foreach(used IN LISTS arg_USES)
    target_link_libraries(${module}_headers INTERFACE ${used}_headers)
  endforeach()
  list(JOIN arg_USES " " uses)
  list(JOIN arg_PUBLIC " " public)
  set_property(GLOBAL APPEND PROPERTY DELASSUS_MODULES "${module}|${arg_FOLDER}|${uses}|${public}")
endfunction()

# Sets result to the sources of a module.
function(delassus_sources module result)
  get_target_property(folder ${module}_headers DELASSUS_FOLDER)
  file(GLOB sources CONFIGURE_DEPENDS "${folder}/*.cpp")
  set(${result} "${sources}" PARENT_SCOPE)
endfunction()

# delassus_objects(<module> [LIBRARIES target…]): the objects of a module that goes into a library with others, as the
# target delassus_<module>.
function(delassus_objects module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "LIBRARIES")
  delassus_sources(${module} sources)
  add_library(delassus_${module} OBJECT ${sources})
  target_link_libraries(delassus_${module} PRIVATE ${module}_headers delassus_settings ${arg_LIBRARIES})
endfunction()

# delassus_install_library(<target>): a shared library; who links against it wants the package of development files too.
function(delassus_install_library target)
  set_property(GLOBAL APPEND PROPERTY DELASSUS_LIBRARIES ${target})
  install(TARGETS ${target} EXPORT delassusCoreTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
endfunction()

# delassus_library(<module> [OBJECTS module…] PUBLIC target… [PRIVATE target…] [SOURCES file…]): a module as
# libdelassus_<module>, consumed as delassus::<module>. OBJECTS: modules whose objects go into it. SOURCES: beside those of its
# folder.
function(delassus_library module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "OBJECTS;PUBLIC;PRIVATE;SOURCES")
  delassus_sources(${module} sources)
  foreach(other IN LISTS arg_OBJECTS)
    list(APPEND sources $<TARGET_OBJECTS:delassus_${other}>)
  endforeach()
  add_library(delassus_${module} SHARED ${sources} ${arg_SOURCES})
  add_library(delassus::${module} ALIAS delassus_${module})
  target_link_libraries(delassus_${module} PUBLIC ${arg_PUBLIC} $<BUILD_INTERFACE:${module}_headers>
    PRIVATE delassus_settings Eigen3::Eigen fmt::fmt ${arg_PRIVATE})
  set_target_properties(delassus_${module} PROPERTIES VERSION ${PROJECT_VERSION} EXPORT_NAME ${module}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} INSTALL_RPATH "$ORIGIN")
  delassus_install_library(delassus_${module})
endfunction()

# delassus_loaded_module(<name> SOURCES file… LIBRARIES target… [COMPONENT component]): a part with a heavy dependency, which its
# loader opens at need. COMPONENT: what it is installed with, `library` unless said; `plugins` for what solvers need as well.
function(delassus_loaded_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "COMPONENT" "SOURCES;LIBRARIES")
  if(NOT arg_COMPONENT)
    set(arg_COMPONENT library)
  endif()
  add_library(${name} MODULE ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} delassus_settings fmt::fmt)
  set_target_properties(${name} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY "${DELASSUS_MODULE_DIRECTORY}"
    INSTALL_RPATH "$ORIGIN/..")
  install(TARGETS ${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/delassus COMPONENT ${arg_COMPONENT})
  set_property(GLOBAL APPEND PROPERTY DELASSUS_LOADED_MODULES ${name})
endfunction()

# delassus_write_modules(): modules.txt in the build folder, for scripts/check-layers. Fails for a public header of no module.
function(delassus_write_modules)
  get_property(modules GLOBAL PROPERTY DELASSUS_MODULES)
  file(GLOB headers "${PROJECT_SOURCE_DIR}/core/include/delassus/*")
  foreach(header IN LISTS headers)
    if(NOT "${modules}" MATCHES "${header}")
      message(FATAL_ERROR "${header} belongs to no module: name it in core/src/CMakeLists.txt")
    endif()
  endforeach()
  list(JOIN modules "\n" text)
  file(WRITE "${PROJECT_BINARY_DIR}/modules.txt" "${text}\n")
endfunction()
