# find_package(actq) gives the target actq::actq: the static library for @CORE@, and its headers.
include(CheckCSourceCompiles)
include(CheckCXXSourceCompiles)

# Is the condition true in the preprocessor, with the core's options that the project has set so far?
function(_actq_check condition result)
  get_directory_property(options COMPILE_OPTIONS)
  list(FILTER options INCLUDE REGEX "^-m")
  list(JOIN options " " CMAKE_REQUIRED_FLAGS)
  set(CMAKE_REQUIRED_QUIET TRUE)
  # A program may need more than the compiler to be linked.
  set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
  set(source "#if !(${condition})\n#error another core\n#endif\nint main(void) { return 0; }\n")
  # The options may have changed since the last run.
  unset(_actq_compiles CACHE)
  if(CMAKE_C_COMPILER_LOADED)
    check_c_source_compiles("${source}" _actq_compiles)
  else()
    check_cxx_source_compiles("${source}" _actq_compiles)
  endif()
  set(${result} "${_actq_compiles}" PARENT_SCOPE)
endfunction()

_actq_check("@MACROS@" _actq_is_core)
if(NOT _actq_is_core)
  set(actq_FOUND FALSE)
  set(actq_NOT_FOUND_MESSAGE "The package is for @CORE@, and the compiler's options are for another core. Take that core's package, or set the options (@FLAGS@) before find_package, in CMAKE_C_FLAGS or by add_compile_options.")
  return()
endif()

get_filename_component(_actq_root "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
set(_actq_library "${_actq_root}/lib/libactq.a")
_actq_check("defined(__ARM_PCS_VFP)" _actq_is_hard_float)
if(NOT _actq_is_hard_float AND EXISTS "${_actq_root}/lib/soft-float/libactq.a")
  set(_actq_library "${_actq_root}/lib/soft-float/libactq.a")
endif()
if(NOT TARGET actq::actq)
  add_library(actq::actq STATIC IMPORTED)
  set_target_properties(actq::actq PROPERTIES
    IMPORTED_LOCATION "${_actq_library}"
    INTERFACE_INCLUDE_DIRECTORIES "${_actq_root}/include")
endif()
