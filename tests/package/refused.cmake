# SPDX-License-Identifier: MIT
# Configures a host project that must be refused, and prints on one line why it was.
string(REPLACE "|" ";" options "${options}")
file(REMOVE_RECURSE "${host}")
execute_process(COMMAND "${CMAKE_COMMAND}" -B "${host}" ${options} OUTPUT_VARIABLE output ERROR_VARIABLE output
                RESULT_VARIABLE result)
if(result EQUAL 0)
  message("${output}")
  message(FATAL_ERROR "was not refused")
endif()
string(REGEX REPLACE "[ \n]+" " " output "${output}")
message("refused as expected: ${output}")
