#!/bin/sh
# SPDX-License-Identifier: MIT
# The balance that the solvers find is that of membrane theory.
#   sh check_statics.sh path/to/statics
program=$1
. "${0%/*}/../../check.sh"

album statics_profile statics_convergence
cat drawn.out
# Yardstick: Timoshenko's 0.07367 q a^2/T for a square membrane.
awk '/membrane theory says/ { w = 0.07367 * $7 * 0.01 / $10 * 1000; found = 1; exit !(w / $(NF - 1) > 0.999 && w / $(NF - 1) < 1.001) } END { if (!found) exit 1 }' drawn.out ||
  fail "theory is not 0.07367 q a^2/T"
# A mesh of 30 edges a side: the differences are of the order of 1/30^2 of the sag, and the solvers agree to their tolerance.
awk '/Relaxation|Newton/ { ++rows; if ($(NF - 1) > 0.3 || $(NF - 1) < -0.3) bad = 1; if (rows == 1) first = $4; d = $4 / first - 1; if (d > 1e-4 || d < -1e-4) bad = 1 }
  END { exit bad || rows != 3 }' drawn.out || fail "the solvers do not find the balance of theory"
# A stretched skin is stiffer than theory, which keeps its tension.
awk '/twenty times/ { found = 1; exit !($(NF - 5) < 98 && $(NF - 5) > 50) } END { if (!found) exit 1 }' drawn.out || fail "under twenty times the load"
finish
