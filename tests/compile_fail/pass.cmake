# SPDX-License-Identifier: MIT
set(compiler "${compiler_0}")
set(flags "${flags_0}")
include("${CMAKE_CURRENT_LIST_DIR}/compile.cmake")
if(NOT result EQUAL 0)
  message("${output}")
  message(FATAL_ERROR "should compile: ${source}")
endif()
