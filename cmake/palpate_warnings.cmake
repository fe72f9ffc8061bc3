# SPDX-License-Identifier: MIT
# The warnings our own programs are built with. Never linked into an exported target.
if(NOT TARGET palpate_warnings)
  add_library(palpate_warnings INTERFACE)
  if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    target_compile_options(palpate_warnings INTERFACE -Wall -Wextra -Wconversion -Wshadow)
  endif()
endif()
