# cellcal_room(NAME USES rooms... LINKS targets...): the static library cellcal_NAME of all .cc files of
# the folder. What it may include is its own folder and the rooms it uses, no others: the build fails
# where a file does.
set(CELLCAL_ARROWS ${CMAKE_CURRENT_LIST_DIR}/arrows.cmake)

function(cellcal_room name)
  cmake_parse_arguments(ARG "" "" "USES;LINKS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  file(GLOB headers CONFIGURE_DEPENDS *.h)
  file(RELATIVE_PATH room ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  add_library(cellcal_${name} STATIC ${sources})
  list(TRANSFORM ARG_USES PREPEND cellcal_ OUTPUT_VARIABLE targets)
  target_link_libraries(cellcal_${name} PUBLIC cellcal_options Eigen3::Eigen ${targets} PRIVATE ${ARG_LINKS})

  get_filename_component(house ${room} DIRECTORY)
  list(TRANSFORM ARG_USES PREPEND ${house}/ OUTPUT_VARIABLE may)
  list(JOIN may "," may)
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/${name}.arrows)
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${CMAKE_COMMAND} -DROOM=${room} -DMAY=${may} -DSTAMP=${stamp} -DSOURCE=${PROJECT_SOURCE_DIR}
            -P ${CELLCAL_ARROWS}
    DEPENDS ${sources} ${headers} ${CELLCAL_ARROWS}
    COMMENT "Arrows of ${room}")
  add_custom_target(cellcal_${name}_arrows DEPENDS ${stamp})
  add_dependencies(cellcal_${name} cellcal_${name}_arrows)
endfunction()
