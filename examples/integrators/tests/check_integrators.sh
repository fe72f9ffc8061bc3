#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs the comparison and reads its table. Times are looked at for their order alone.
#   sh check_integrators.sh path/to/integrators
program=$1
. "${0%/*}/../../check.sh"

run table 0
cat table.out
# A row each: name, stable step, steps, median, least, "...", most, error. Euler's methods and Stoermer's (its damping is a step late) are of first order:
# their error is at most 0.15 m/s times the step. The others have all six digits of the reference, -2.13427 m, at these steps.
awk 'NR == 1 { next } {
    ++rows
    if (NF != 8 || !($5 <= $4 && $4 <= $7 && $5 > 0)) { print "no median between least and most:", $0; bad = 1 }
    limit = $1 ~ /Euler|Stoermer/ ? 0.15 * 7 / $3 : 5.5e-6
    if (!($8 >= 0 && $8 <= limit)) { print "too far off:", $0; bad = 1 }
  } END { exit bad || rows != 10 }' table.out || fail "not a table of ten integrators"
exit "$failed"
