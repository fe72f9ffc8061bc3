#!/bin/sh
# SPDX-License-Identifier: MIT
# A probe on a thigh: the vein flattens, the speckle goes where the tissue goes and has the contrast that theory says, and twice the same bytes come out.
#   sh check_echography.sh path/to/echography
program=$1
. "${0%/*}/../../check.sh"

album echography_vein echography_thigh echography_pictures
cat drawn.out
# The force grows. The vein is round at first, pi r2 in area, then wider, lower and smaller, and its walls never cross. It loses a thousand times the share
# that the flesh loses.
awk '/^depth/ { next } /^ +[0-9.]+ +[0-9.]+ +[0-9.]+ +[0-9.]+ +[0-9.]+ +[0-9.]+ +[0-9.]+$/ {
    if (rows++ && !($2 > force && $4 < share && $5 > wide && $6 < high)) { print "not on:", $0; bad = 1 }
    if (rows == 1 && ($3 < 0.97 * 95.03 || $3 > 95.03 || $6 / $5 < 0.98 || $6 / $5 > 1.02)) { print "not round:", $0; bad = 1 }
    if ($6 <= 0 || 1 - $4 < 1000 * $7 - 1e-9) { print "crossed, or flesh lost:", $0; bad = 1 }
    force = $2; share = $4; wide = $5; high = $6
  }
  END { exit bad || rows != 6 || share > 0.4 }' drawn.out || fail "the vein does not flatten"
# Fully developed speckle: mean over deviation of a Rayleigh distribution, 1.913.
awk '/^speckle/ { ++rows; if ($(NF - 4) + 0 < 1.81 || $(NF - 4) + 0 > 2.01 || $NF != 1.913) bad = 1 } END { exit bad || rows != 1 }' drawn.out ||
  fail "not Rayleigh's contrast"
# Fat is darker, bone far brighter; blood and what lies behind bone are black; what lies behind blood is brighter by what it did not absorb.
awk -F '[ ,]+' '/^dB/ { ++rows; bad = !($5 > -12 && $5 < -3 && $7 < -40 && $10 > $14 - 1 && $10 < $14 + 1 && $16 > 15 && $19 < -30) }
  END { exit bad || rows != 1 }' drawn.out || fail "not the brightness of these tissues"
# Patches are found again where the tissue has gone: within 0.04 mm along the beam, an eighth of a wavelength, and 0.154 mm across, half of one.
awk '/^from / { table = 1; next } /^scatterers/ { table = 0 } table && NF == 7 { ++rows
    if (far($4 - $6) > 0.04 || far($3 - $5) > 0.154 || far($6) < 0.05 || $7 < 0.85) { print "not followed:", $0; bad = 1 } }
  function far(x) { return x < 0 ? -x : x }
  END { exit bad || rows != 7 }' drawn.out || fail "the speckle does not follow the tissue"
run again 0 again/here
sed 's,again/here,pictures/here,' again.out | cmp - drawn.out || fail "other numbers the second time"
if [ -d pictures ]; then diff -r pictures again || fail "other pictures the second time"; fi
finish
