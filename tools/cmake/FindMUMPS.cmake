# The sequential MUMPS of the distribution (libmumps-seq-dev): MUMPS::MUMPS, in double precision, and
# in single precision where that library is there.
find_path(MUMPS_INCLUDE_DIR dmumps_c.h)
find_path(MUMPS_SEQ_INCLUDE_DIR mpi.h PATH_SUFFIXES mumps_seq NO_DEFAULT_PATH PATHS /usr/include)
find_library(MUMPS_D_LIBRARY NAMES dmumps_seq)
find_library(MUMPS_S_LIBRARY NAMES smumps_seq)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MUMPS REQUIRED_VARS
  MUMPS_D_LIBRARY MUMPS_INCLUDE_DIR MUMPS_SEQ_INCLUDE_DIR)
if(MUMPS_FOUND AND NOT TARGET MUMPS::MUMPS)
  add_library(MUMPS::MUMPS INTERFACE IMPORTED)
  set_target_properties(MUMPS::MUMPS PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${MUMPS_INCLUDE_DIR};${MUMPS_SEQ_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${MUMPS_D_LIBRARY}")
  if(MUMPS_S_LIBRARY)
    set_property(TARGET MUMPS::MUMPS APPEND PROPERTY
      INTERFACE_LINK_LIBRARIES "${MUMPS_S_LIBRARY}")
  endif()
endif()
