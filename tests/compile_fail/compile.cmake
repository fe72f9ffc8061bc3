# SPDX-License-Identifier: MIT
# The source, by compiler k: sets compiler, result and output.
set(compiler "${compiler_${k}}")
string(REPLACE "|" ";" flags "${flags_${k}}")
execute_process(COMMAND "${compiler}" ${flags} "${source}" RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
