#!/bin/sh
# SPDX-License-Identifier: MIT
# A gall bladder is cut off its bed: hand and bed bear its weight, the pull falls as the seam parts, one piece becomes two, and each bears its own m g.
#   sh check_gall_bladder.sh path/to/gall_bladder
program=$1
. "${0%/*}/../../check.sh"

album gall_bladder_forces gall_bladder_before gall_bladder_drawn gall_bladder_cut gall_bladder_taken
cat drawn.out
awk '/that weighs/ { weight = $(NF - 6); if (is_off(weight, 0.015 * 9.81, 1e-4)) wrong("is not 15 g") }
  $1 ~ /^[0-9.]+$/ && $6 ~ /^[0-9]+$/ { ++rows
    if ($6 != ($1 < 4.3 ? 1 : 2)) wrong("is in other pieces")
    if (($1 <= 1.7) != ($5 == 0) || $5 < last_cut) wrong("is cut at another time")
    last_cut = $5
    if (($1 < 0.25 || $1 > 5.3) && is_off($4, weight, 0.003 * weight)) wrong("is at rest, and hand and bed do not bear it")
    if ($1 > 1.3 && $1 < 1.7 && is_off($4, weight, 0.01 * weight)) wrong("is held, but for a wrinkle that snaps, and hand and bed do not bear it")
    if ($1 < 0.25 && $2 != 0) wrong("is not in the hand yet")
    if ($1 == 1.6) { drawn = $2; if (drawn < 10 * weight) wrong("is not drawn up") }
    if ($1 == 3.2 && ($2 > 0.7 * drawn || $2 < 0.3 * drawn)) wrong("is half cut off, and the pull is not about half")
    if ($1 == 4.2 && $2 > 0.06 * drawn) wrong("hangs on the bed still")
    hand = $2; bed = $3
  }
  /^seam/ { ++ends; if (is_off($6, $2, 0.03 * $2) || is_off($9, $(NF - 1), 2e-4)) wrong("is not the seam, or not the area that the cutter reports") }
  /^on the bed/ { ++ends; stays = $(NF - 1); if (is_off(bed, stays, 0.005 * weight)) wrong("is more or less than the bed bears") }
  /^taken away/ { ++ends; goes = $(NF - 1); if (goes < 0.4 * weight || is_off(hand, goes, 0.005 * weight)) wrong("is more or less than the hand bears") }
  /^the shaft/ { ++ends; if ($8 > 1e-14 || $17 < 30 || $23 < 30 || $23 != $(NF - 1)) wrong("is not on its trocar") }
  function is_off(value, wanted, off) { return value < wanted - off || value > wanted + off }
  function wrong(what) { print what ":", $0; bad = 1 }
  END { exit bad || rows != 30 || ends != 4 || is_off(stays + goes, weight, 1.5e-4) }' drawn.out || fail "not what is found by hand"
run again 0 again/here
sed 's,again/here,pictures/here,' again.out | cmp - drawn.out || fail "other numbers the second time"
if [ -d pictures ]; then diff -r pictures again || fail "other pictures the second time"; fi
finish
