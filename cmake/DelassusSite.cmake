# Target `site`: the documentation as one site, in site/html of the build folder: pages, tutorial, notebooks with their outputs,
# the Python reference, the C++ reference of the target `reference`. A warning or a broken link is an error.
set(reason "")
if(NOT TARGET reference)
  set(reason "there is no target `reference`")
elseif(NOT TARGET python_with_plugins)
  set(reason "the Python package is left out")
else()
  foreach(module "sphinx python3-sphinx" "myst_parser python3-myst-parser" "furo furo" "nbconvert jupyter-nbconvert"
                 "ipykernel python3-ipykernel" "matplotlib python3-matplotlib")
    string(REPLACE " " ";" names "${module}")
    list(GET names 0 name)
    list(GET names 1 package)
    execute_process(COMMAND "${Python_EXECUTABLE}" -c
      "import importlib.util, sys; sys.exit(importlib.util.find_spec('${name}') is None)" RESULT_VARIABLE missing)
    if(missing)
      set(reason "${Python_EXECUTABLE} has no ${name} (${package})")
    endif()
  endforeach()
endif()
if(reason)
  message(STATUS "No target `site`: ${reason}")
  return()
endif()
add_custom_target(site
  COMMAND "${CMAKE_COMMAND}" -E env "PYTHONPATH=${PROJECT_BINARY_DIR}/${DELASSUS_PYTHON_DIRECTORY}" PYTHONDONTWRITEBYTECODE=1
    "${Python_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/scripts/build-site" "${PROJECT_BINARY_DIR}/site"
    --reference "${DELASSUS_REFERENCE_DIRECTORY}/html"
  WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
  VERBATIM)
add_dependencies(site reference python_with_plugins)
