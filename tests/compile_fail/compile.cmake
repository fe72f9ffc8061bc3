# SPDX-License-Identifier: MIT
string(REPLACE "|" ";" flags "${flags}")
execute_process(COMMAND "${compiler}" ${flags} "${source}" RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
