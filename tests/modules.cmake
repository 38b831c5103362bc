# Modules and their dependencies. The build fails on an undeclared dependency and on a declared one that is not used;
# a dependency against the layers, or in a cycle, fails at configure.
set(CELLCAL_MODULES_FILE ${CMAKE_CURRENT_LIST_FILE})

# cmake -DMODULE=calib/estimate -DMAY=calib/model,calib/result -DSTAMP=FILE -DSOURCE=... -P tests/modules.cmake: fails
# if a file of the module includes one of a module that it does not declare, or none includes one of a declared module.
if(CMAKE_SCRIPT_MODE_FILE)
  cmake_policy(VERSION 3.25)
  string(REPLACE "," ";" MAY "${MAY}")
  file(GLOB files ${SOURCE}/${MODULE}/*.h ${SOURCE}/${MODULE}/*.cc ${SOURCE}/${MODULE}/*.c)
  set(unused ${MAY})
  foreach(file ${files})
    file(STRINGS ${file} includes REGEX "^ *# *include [\"<](calib|daemon|drivers|sim|tests)/")
    foreach(include ${includes})
      string(REGEX REPLACE "^ *# *include [\"<](.*)/[^/]*[\">].*" "\\1" of "${include}")
      if(NOT of STREQUAL MODULE AND NOT of IN_LIST MAY)
        list(JOIN MAY ", " modules)
        message(FATAL_ERROR "${file}: ${include}: ${MODULE} may use ${modules}, and not ${of}")
      endif()
      list(REMOVE_ITEM unused ${of})
    endforeach()
  endforeach()
  if(unused)
    list(JOIN unused ", " modules)
    message(FATAL_ERROR "${SOURCE}/${MODULE}/CMakeLists.txt: ${MODULE} names ${modules} under USES, and no file of it "
                        "includes one of there: take it out")
  endif()
  file(TOUCH ${STAMP})
  return()
endif()

# calib and drivers depend on nothing else; the emulated cell enters the daemon through daemon/backends alone, and nothing
# that is shipped depends on a test.
function(cellcal_require_direction module of)
  string(REGEX MATCH "^[^/]*" from ${module})
  string(REGEX MATCH "^[^/]*" to ${of})
  set(may_calib calib)
  set(may_drivers drivers)
  set(may_sim calib drivers sim)
  set(may_daemon calib drivers daemon)
  if(module STREQUAL "daemon/backends")
    list(APPEND may_daemon sim)
  endif()
  if(NOT to IN_LIST may_${from})
    message(FATAL_ERROR "${module}/CMakeLists.txt: USES ${of}: ${module} may use ${may_${from}}, and not ${to}")
  endif()
endfunction()

# Fails on a cycle of modules. Called when all are declared: removes those that use none of the rest until none is left.
function(cellcal_require_no_cycle)
  get_property(modules GLOBAL PROPERTY CELLCAL_MODULES)
  list(REMOVE_DUPLICATES modules)
  while(modules)
    set(rest)
    foreach(module ${modules})
      get_property(uses GLOBAL PROPERTY CELLCAL_USES_OF_${module})
      list(REMOVE_ITEM uses ${module})
      foreach(of ${uses})
        if(of IN_LIST modules)
          list(APPEND rest ${module})
          break()
        endif()
      endforeach()
    endforeach()
    if(rest STREQUAL modules)
      list(JOIN modules ", " modules)
      message(FATAL_ERROR "these modules contain a dependency cycle: ${modules}")
    endif()
    set(modules ${rest})
  endwhile()
endfunction()

# cellcal_uses(TARGET USES folders...): files of this folder may include, of the project, the folder
# itself and the named ones, by their path from the root (calib/model).
function(cellcal_uses target)
  cmake_parse_arguments(ARG "" "" "USES" ${ARGN})
  file(GLOB files CONFIGURE_DEPENDS *.cc *.h *.c)
  file(RELATIVE_PATH module ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  foreach(of ${ARG_USES})
    cellcal_require_direction(${module} ${of})
  endforeach()
  set_property(GLOBAL APPEND PROPERTY CELLCAL_MODULES ${module})
  set_property(GLOBAL PROPERTY CELLCAL_USES_OF_${module} ${ARG_USES})
  list(JOIN ARG_USES "," may)
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/uses.stamp)
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${CMAKE_COMMAND} -DMODULE=${module} -DMAY=${may} -DSTAMP=${stamp} -DSOURCE=${PROJECT_SOURCE_DIR}
            -P ${CELLCAL_MODULES_FILE}
    DEPENDS ${files} ${CELLCAL_MODULES_FILE}
    COMMENT "Dependencies of ${module}")
  add_custom_target(${target}_uses DEPENDS ${stamp})
  add_dependencies(${target} ${target}_uses)
endfunction()

# cellcal_module(NAME USES modules... LINKS targets...): a module of calib, the static library cellcal_NAME of all .cc files
# of the folder. Modules by their folder below calib/.
function(cellcal_module name)
  cmake_parse_arguments(ARG "" "" "USES;LINKS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  add_library(cellcal_${name} STATIC ${sources})
  list(TRANSFORM ARG_USES REPLACE "/" "_" OUTPUT_VARIABLE targets)
  list(TRANSFORM targets PREPEND cellcal_)
  target_link_libraries(cellcal_${name} PUBLIC cellcal_options Eigen3::Eigen ${targets} PRIVATE ${ARG_LINKS})
  # The installed libraries consist of the same objects (calib/library). Their functions are not interposed, so they may be
  # inlined as in a program. Eigen costs minutes per file: small batches compile in parallel.
  set_target_properties(cellcal_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON UNITY_BUILD_BATCH_SIZE 5)
  target_compile_options(cellcal_${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
  list(TRANSFORM ARG_USES PREPEND calib/ OUTPUT_VARIABLE may)
  cellcal_uses(cellcal_${name} USES ${may})
endfunction()
