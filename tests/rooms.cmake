# Rooms, and the arrows between them. An arrow that is not named here fails the build, and so does a name that nothing
# needs; one that points the wrong way, or closes a circle, is not taken to begin with.
set(CELLCAL_ARROWS ${CMAKE_CURRENT_LIST_FILE})

# cmake -DROOM=calib/estimate -DMAY=calib/model,calib/result -DSTAMP=FILE -DSOURCE=... -P tests/rooms.cmake: fails
# where a file of the room includes one of a room that it does not use, or none includes one of a room that it names.
if(CMAKE_SCRIPT_MODE_FILE)
  cmake_policy(VERSION 3.25)
  string(REPLACE "," ";" MAY "${MAY}")
  file(GLOB files ${SOURCE}/${ROOM}/*.h ${SOURCE}/${ROOM}/*.cc ${SOURCE}/${ROOM}/*.c)
  set(unused ${MAY})
  foreach(file ${files})
    file(STRINGS ${file} includes REGEX "^ *# *include [\"<](calib|daemon|drivers|sim|tests)/")
    foreach(include ${includes})
      string(REGEX REPLACE "^ *# *include [\"<](.*)/[^/]*[\">].*" "\\1" of "${include}")
      if(NOT of STREQUAL ROOM AND NOT of IN_LIST MAY)
        list(JOIN MAY ", " rooms)
        message(FATAL_ERROR "${file}: ${include}: ${ROOM} may use ${rooms}, and not ${of}")
      endif()
      list(REMOVE_ITEM unused ${of})
    endforeach()
  endforeach()
  if(unused)
    list(JOIN unused ", " rooms)
    message(FATAL_ERROR "${SOURCE}/${ROOM}/CMakeLists.txt: ${ROOM} names ${rooms} under USES, and no file of it "
                        "includes one of there: take it out")
  endif()
  file(TOUCH ${STAMP})
  return()
endif()

# The mathematics stand by themselves, and so do the drivers; what is emulated comes in at one door alone, and nothing
# that is shipped hangs on a test.
function(cellcal_require_direction room of)
  string(REGEX MATCH "^[^/]*" from ${room})
  string(REGEX MATCH "^[^/]*" to ${of})
  set(may_calib calib)
  set(may_drivers drivers)
  set(may_sim calib drivers sim)
  set(may_daemon calib drivers daemon)
  if(room STREQUAL "daemon/backends")
    list(APPEND may_daemon sim)
  endif()
  if(NOT to IN_LIST may_${from})
    message(FATAL_ERROR "${room}/CMakeLists.txt: USES ${of}: ${room} may use ${may_${from}}, and not ${to}")
  endif()
endfunction()

# Fails where rooms use each other in a circle. Called when all are known: takes away those that use none of the rest
# until none is left.
function(cellcal_require_no_circle)
  get_property(rooms GLOBAL PROPERTY CELLCAL_ROOMS)
  list(REMOVE_DUPLICATES rooms)
  while(rooms)
    set(rest)
    foreach(room ${rooms})
      get_property(uses GLOBAL PROPERTY CELLCAL_USES_OF_${room})
      list(REMOVE_ITEM uses ${room})
      foreach(of ${uses})
        if(of IN_LIST rooms)
          list(APPEND rest ${room})
          break()
        endif()
      endforeach()
    endforeach()
    if(rest STREQUAL rooms)
      list(JOIN rooms ", " rooms)
      message(FATAL_ERROR "a circle of rooms that use each other is among these: ${rooms}")
    endif()
    set(rooms ${rest})
  endwhile()
endfunction()

# cellcal_arrows(TARGET USES folders...): what this folder's files may include of the project is the folder
# itself and those that it names, from the top (calib/model), no others.
function(cellcal_arrows target)
  cmake_parse_arguments(ARG "" "" "USES" ${ARGN})
  file(GLOB files CONFIGURE_DEPENDS *.cc *.h *.c)
  file(RELATIVE_PATH room ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  foreach(of ${ARG_USES})
    cellcal_require_direction(${room} ${of})
  endforeach()
  set_property(GLOBAL APPEND PROPERTY CELLCAL_ROOMS ${room})
  set_property(GLOBAL PROPERTY CELLCAL_USES_OF_${room} ${ARG_USES})
  list(JOIN ARG_USES "," may)
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/arrows.stamp)
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${CMAKE_COMMAND} -DROOM=${room} -DMAY=${may} -DSTAMP=${stamp} -DSOURCE=${PROJECT_SOURCE_DIR}
            -P ${CELLCAL_ARROWS}
    DEPENDS ${files} ${CELLCAL_ARROWS}
    COMMENT "Arrows of ${room}")
  add_custom_target(${target}_arrows DEPENDS ${stamp})
  add_dependencies(${target} ${target}_arrows)
endfunction()

# cellcal_room(NAME USES rooms... LINKS targets...): a room of the mathematics, the static library
# cellcal_NAME of all .cc files of the folder. Rooms by their folder below calib/ (plan/reach, whose
# library is cellcal_plan).
function(cellcal_room name)
  cmake_parse_arguments(ARG "" "" "USES;LINKS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  add_library(cellcal_${name} STATIC ${sources})
  list(TRANSFORM ARG_USES REPLACE "/" "_" OUTPUT_VARIABLE targets)
  list(TRANSFORM targets PREPEND cellcal_)
  target_link_libraries(cellcal_${name} PUBLIC cellcal_options Eigen3::Eigen ${targets} PRIVATE ${ARG_LINKS})
  # The installed libraries are made of the same objects (calib/library). Nobody interposes one of these
  # functions, so they may be inlined as in a program.
  # Eigen takes the compiler minutes per file: some files at a time, side by side.
  set_target_properties(cellcal_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON UNITY_BUILD_BATCH_SIZE 5)
  target_compile_options(cellcal_${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
  list(TRANSFORM ARG_USES PREPEND calib/ OUTPUT_VARIABLE may)
  cellcal_arrows(cellcal_${name} USES ${may})
endfunction()
