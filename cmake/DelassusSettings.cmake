# Settings shared by everything that is built here.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 11)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

# The build tree has the layout of an install tree, so that what is found relative to libdelassus is found in both.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/${CMAKE_INSTALL_BINDIR}")
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/${CMAKE_INSTALL_LIBDIR}")
set(DELASSUS_MODULE_DIRECTORY "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/delassus")
set(DELASSUS_PLUGIN_DIRECTORY "${DELASSUS_MODULE_DIRECTORY}/plugins")
set(DELASSUS_PLUGIN_DESTINATION "${CMAKE_INSTALL_LIBDIR}/delassus/plugins")  # below the prefix

add_library(delassus_settings INTERFACE)
target_compile_options(delassus_settings INTERFACE -Wall -Wextra -Wshadow -Wpedantic -Wconversion -Wno-sign-conversion)
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # In a batch of files none is the main one, whose types in unnamed namespaces g++ would let pass as members.
  target_compile_options(delassus_settings INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>)
endif()
# Sources are named from the project's folder on (__FILE__), so that clones share compiled files.
target_compile_options(delassus_settings INTERFACE "-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=")
if(DELASSUS_WERROR)
  target_compile_options(delassus_settings INTERFACE -Werror)
endif()
if(DELASSUS_SANITIZE STREQUAL "thread")
  add_compile_options(-fsanitize=thread -fno-omit-frame-pointer)
  add_link_options(-fsanitize=thread)
elseif(DELASSUS_SANITIZE)
  # Checks of every pointer before its use, and of scopes, double the time to compile Eigen's code (119 s and 62 s for a
  # batch of core/src/mechanics); the address sanitizer stops at most of what they find.
  add_compile_options(-fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined
    -fno-sanitize=null,alignment,object-size,vptr,pointer-overflow,nonnull-attribute,returns-nonnull-attribute
    -fno-sanitize-address-use-after-scope)
  add_link_options(-fsanitize=address,undefined)
endif()
if(DELASSUS_COVERAGE)
  add_compile_options(--coverage -fprofile-update=atomic)
  add_link_options(--coverage)
endif()

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
if(POLICY CMP0167)
  cmake_policy(SET CMP0167 NEW)  # Boost's own configuration file, which all releases have
endif()
find_package(Boost 1.71 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(Threads REQUIRED)

find_program(CCACHE_PROGRAM ccache)
delassus_dependency(ccache CCACHE_PROGRAM)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CCACHE_PROGRAM}")
endif()
