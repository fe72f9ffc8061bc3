# SPDX-License-Identifier: MIT
# Uses ccache where it is installed; the sloppiness is what it needs to cache sources with a precompiled header. It goes by the headers themselves
# (CCACHE_DEPEND), never by what the preprocessor leaves of them: a precompiled header of which only a comment has changed came back as it was
# before, and gcc, which knows a header by all of its text, read it again: "redefinition".
find_program(PALPATE_CCACHE ccache)
mark_as_advanced(PALPATE_CCACHE)
if(PALPATE_CCACHE AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env
      CCACHE_DEPEND=1 CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime "${PALPATE_CCACHE}")
endif()
