#!/bin/sh
# SPDX-License-Identifier: MIT
# A lobe is lifted off another organ and let down again: at rest hand, root and lower organ bear its weight, and the vessel is seen while it is up.
#   sh check_lift.sh path/to/lift
program=$1
. "${0%/*}/../../check.sh"

album lift_forces lift_covered lift_lifted
cat drawn.out
awk '/weighs/ { weight = $(NF - 1) }
  /^the vessel/ { long = $(NF - 2) }
  $1 ~ /^[0-9.]+$/ && NF > 6 { ++rows; sum = $2 + $3 + $4
    if (is_off($5, sum, 0.00016)) wrong("not the sum")
  }
  /comes$/ && $1 < 0.15 { ++lies; before = $4
    if ($2 != 0 || $6 != 0 || is_off(sum, weight, 0.003 * weight) || $4 < 0.4 * weight || $3 < 0.2 * weight) wrong("does not lie")
  }
  /holds$/ && $1 > 1.55 { ++holds
    if ($4 != 0 || $6 < 0.99 * long || is_off(sum, weight, 0.01 * weight) || $2 < 0.4 * weight || $3 < 0.2 * weight) wrong("is not held")
  }
  /is gone$/ && $1 > 3.45 { ++gone
    if ($2 != 0 || $6 != 0 || is_off(sum, weight, 0.003 * weight) || is_off($4, before, 0.03 * before)) wrong("does not lie as before")
  }
  function is_off(value, wanted, off) { return value < wanted - off || value > wanted + off }
  function wrong(what) { print what ":", $0; bad = 1 }
  END { exit bad || rows != 39 || lies != 2 || holds != 4 || gone != 4 }' drawn.out || fail "not what is found by hand"
run again 0 again/here
sed 's,again/here,pictures/here,' again.out | cmp - drawn.out || fail "other numbers the second time"
if [ -d pictures ]; then diff -r pictures again || fail "other pictures the second time"; fi
finish
