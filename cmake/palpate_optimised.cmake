# SPDX-License-Identifier: MIT
# What programs are compiled with that compute much, where the build type optimises nothing (the presets plain and asan). Half of what -O1 takes with the
# sanitizers of clang is choosing instructions and registers well and carrying lines along, for code that is run once.
set(palpate_optimised -O1)
if(CMAKE_CXX_COMPILER_ID MATCHES "Clang" AND CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  list(APPEND palpate_optimised -g0 "SHELL:-mllvm -fast-isel=true" "SHELL:-mllvm -regalloc=fast")
endif()
