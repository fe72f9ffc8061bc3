#!/bin/sh
# SPDX-License-Identifier: MIT
# A body that moves as one follows the closed form of the damped oscillator, and the proposals keep their guarantees.
#   sh check_damping.sh path/to/damping
program=$1
. "${0%/*}/../../check.sh"

album damping_impulse damping_sheet
cat drawn.out
# Yardsticks, omega = 4/s, 1 m/s: undamped the swing is v/omega = 0.25 m both ways; critical it peaks at v/(e omega) = 0.0920 m; with 0.5 it peaks at
# v/omega exp(-pi/(3 sqrt 3)) = 0.1366 m and swings back by exp(-pi 0.5/sqrt 0.75) = 0.1630 of that, 0.0223 m; with 2 it peaks at 0.0546 m.
awk '$1 == "0.00" { want($2, 0.25); want(-$3, 0.25); close_to($4) }
  $1 == "0.50" { want($2, 0.1366); want(-$3, 0.0223); close_to($4) }
  $1 == "1.00" { want($2, 0.0920); want($3, 0); close_to($4) }
  $1 == "2.00" { want($2, 0.0546); want($3, 0); close_to($4) }
  function want(value, wanted) { ++seen; if (value < wanted - 1e-4 || value > wanted + 1e-4) { print value, "is not", wanted; bad = 1 } }
  function close_to(off) { ++seen; if (!(off < 1e-5)) { print "off by", off; bad = 1 } }
  END { exit bad || seen != 12 }' drawn.out || fail "not the oscillator"
# No damping rings; at most ζ keeps below ζ and still swings where it has less; at least 1 never crosses the balance.
awk '/^none/ { ++rows; if ($NF < 5) bad = 1 }
  /^at most 0.3/ { ++rows; if ($7 > 0.301 || $9 > 0.301 || $7 < $4 || $9 < $4) bad = 1 }
  /^at most 1/ { ++rows; if ($7 > 1.001 || $9 > 1.001) bad = 1 }
  /^at least 1/ { ++rows; if ($NF != 0 || $7 < 0.999 || $9 < 0.999 || $7 > $6 || $9 > $6) bad = 1 }
  END { exit bad || rows != 4 }' drawn.out || fail "a proposal does not keep what it says"
finish
