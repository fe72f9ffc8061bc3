# SPDX-License-Identifier: MIT
include("${CMAKE_CURRENT_LIST_DIR}/compile.cmake")
if(NOT result EQUAL 0)
  message("${output}")
  message(FATAL_ERROR "should compile: ${source}")
endif()
