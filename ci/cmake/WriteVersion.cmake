# Writes version.hpp; called by the target decant_version_header.

set(git_revision unknown)
if(git)
  # A checkout inside another repository would be named by the outer one.
  execute_process(COMMAND ${git} rev-parse --show-toplevel WORKING_DIRECTORY ${source}
    OUTPUT_VARIABLE root OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  file(REAL_PATH "${source}" here)
  if(root STREQUAL here)
    execute_process(COMMAND ${git} describe --always --dirty --tags WORKING_DIRECTORY ${source}
      OUTPUT_VARIABLE described RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(NOT failed)
      set(git_revision ${described})
    endif()
  endif()
endif()
configure_file(${template} ${output} @ONLY)
