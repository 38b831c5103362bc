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

# cellcal_text(TARGET FILE NAMESPACE CONSTANT): makes a file's text part of the target, as a std::string_view, so that an
# installed program needs no other file.
function(cellcal_text target file namespace constant)
  file(READ ${CMAKE_CURRENT_SOURCE_DIR}/${file} text)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  file(CONFIGURE OUTPUT ${constant}.cc @ONLY CONTENT [=[
#include <string_view>

namespace @namespace@ {

extern const std::string_view @constant@;
const std::string_view @constant@ = R"~text~(@text@)~text~";

}  // namespace @namespace@
]=])
  cellcal_sources(${target} ${CMAKE_CURRENT_BINARY_DIR}/${constant}.cc)
endfunction()

# cellcal_uses(folders...): files of this folder may include, of the project, the folder itself and the named ones, by their
# path from the root (calib/model).
function(cellcal_uses)
  file(GLOB files CONFIGURE_DEPENDS *.cc *.h *.c)
  file(RELATIVE_PATH module ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  foreach(of ${ARGN})
    cellcal_require_direction(${module} ${of})
  endforeach()
  set_property(GLOBAL APPEND PROPERTY CELLCAL_MODULES ${module})
  set_property(GLOBAL PROPERTY CELLCAL_USES_OF_${module} ${ARGN})
  set_property(GLOBAL PROPERTY CELLCAL_FILES_OF_${module} ${files})
endfunction()

# cellcal_module(LIBRARY EXCEPT files... USES folders... LINKS targets...): a module, this folder. Its .cc files, but for
# those of programs and of libraries with other links (EXCEPT), become part of a static library, which several may share.
function(cellcal_module library)
  cmake_parse_arguments(ARG "" "" "EXCEPT;USES;LINKS" ${ARGN})
  if(NOT TARGET ${library})
    add_library(${library} STATIC)
    target_link_libraries(${library} PUBLIC cellcal_options)
  endif()
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  list(TRANSFORM ARG_EXCEPT PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  list(REMOVE_ITEM sources ${ARG_EXCEPT})
  cellcal_sources(${library} ${sources})
  target_link_libraries(${library} PUBLIC ${ARG_LINKS})
  cellcal_uses(${ARG_USES})
endfunction()

# cellcal_sources(TARGET files...): of files with absolute paths, those of a folder are compiled as one.
function(cellcal_sources target)
  target_sources(${target} PRIVATE ${ARGN})
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  set(most ${CMAKE_UNITY_BUILD_BATCH_SIZE})
  if(NOT most)
    set(most 1)
  endif()
  foreach(source ${ARGN})
    get_filename_component(folder ${source} DIRECTORY)
    file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${folder})
    string(MAKE_C_IDENTIFIER "${folder}" folder)
    list(APPEND files_${folder} ${source})
    list(LENGTH files_${folder} count)
    math(EXPR batch "(${count} - 1) / ${most}")
    set_source_files_properties(${source} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP ${folder}_${batch})
  endforeach()
endfunction()

# Called when all modules are declared. Fails on a cycle of them: removes those that use none of the rest until none is
# left. Whatever is compiled waits for the check of all of them.
function(cellcal_check_modules)
  get_property(modules GLOBAL PROPERTY CELLCAL_MODULES)
  set(stamps)
  foreach(module ${modules})
    get_property(files GLOBAL PROPERTY CELLCAL_FILES_OF_${module})
    get_property(may GLOBAL PROPERTY CELLCAL_USES_OF_${module})
    list(JOIN may "," may)
    set(stamp ${PROJECT_BINARY_DIR}/${module}/uses.stamp)
    add_custom_command(OUTPUT ${stamp}
      COMMAND ${CMAKE_COMMAND} -DMODULE=${module} -DMAY=${may} -DSTAMP=${stamp} -DSOURCE=${PROJECT_SOURCE_DIR}
              -P ${CELLCAL_MODULES_FILE}
      DEPENDS ${files} ${CELLCAL_MODULES_FILE}
      COMMENT "Dependencies of ${module}")
    list(APPEND stamps ${stamp})
  endforeach()
  add_custom_target(module_dependencies DEPENDS ${stamps})
  add_dependencies(cellcal_options module_dependencies)
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
