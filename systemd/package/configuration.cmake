# Run by cpack before it packs: configuration belongs to /etc (FHS 3.7), not below the prefix.
set(programs ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/programs)
if(EXISTS ${programs}/usr/etc)
  file(RENAME ${programs}/usr/etc ${programs}/etc)
endif()
