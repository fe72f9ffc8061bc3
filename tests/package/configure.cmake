# SPDX-License-Identifier: MIT
# Configures a host project from nothing: -Dhost=<build folder> -Doptions=<options of cmake, separated by |>.
string(REPLACE "|" ";" options "${options}")
file(REMOVE_RECURSE "${host}")
execute_process(COMMAND "${CMAKE_COMMAND}" -B "${host}" ${options} OUTPUT_VARIABLE output ERROR_VARIABLE output
                RESULT_VARIABLE result)
message("${output}")
if(NOT result EQUAL 0)
  message(FATAL_ERROR "the host did not configure")
endif()
