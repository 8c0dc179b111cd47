# find_package(actq) gives the target actq::actq: the static library and its headers.
get_filename_component(_actq_root "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET actq::actq)
  add_library(actq::actq STATIC IMPORTED)
  set_target_properties(actq::actq PROPERTIES
    IMPORTED_LOCATION "${_actq_root}/lib/libactq.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_actq_root}/include")
endif()
