# SPDX-License-Identifier: MIT
# Configures, builds and runs a host project whose program is called `host`.
include("${CMAKE_CURRENT_LIST_DIR}/configure.cmake")
execute_process(COMMAND "${CMAKE_COMMAND}" --build "${host}" --parallel 1 COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${host}/host" WORKING_DIRECTORY "${host}" COMMAND_ERROR_IS_FATAL ANY)
