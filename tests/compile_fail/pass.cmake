# SPDX-License-Identifier: MIT
# The source must compile.
foreach(k IN ITEMS 0 1)
  if(NOT DEFINED compiler_${k})
    continue()
  endif()
  include("${CMAKE_CURRENT_LIST_DIR}/compile.cmake")
  if(NOT result EQUAL 0)
    message("${output}")
    message(FATAL_ERROR "${compiler} should compile ${source}")
  endif()
endforeach()
