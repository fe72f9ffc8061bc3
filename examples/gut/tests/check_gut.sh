#!/bin/sh
# SPDX-License-Identifier: MIT
# A loop of gut falls on a table, folds on itself and comes to rest: the table bears its weight, and part of that goes through the place where it lies on itself.
#   sh check_gut.sh path/to/gut
program=$1
. "${0%/*}/../../check.sh"

album gut_forces gut_before gut_falls gut_rests
cat drawn.out
awk '/weighs/ { weight = $(NF - 1) }
  $1 ~ /^[0-9.]+$/ && NF == 6 { ++rows
    if ($1 == 0 && ($4 != 0 || $5 != 0)) wrong("is not in the air")
    if ($1 > 1.55 && (is_off($4, weight, 0.002 * weight) || $3 > 2 || $5 < 0.1 * weight || $6 < 1)) wrong("does not rest on itself")
    last = $3
  }
  /^it lies/ { ++lies; if ($3 <= 0 || $3 > 1.5) wrong("is not near its own surface") }
  function is_off(value, wanted, off) { return value < wanted - off || value > wanted + off }
  function wrong(what) { print what ":", $0; bad = 1 }
  END { exit bad || rows != 11 || lies != 1 || last > 0.5 }' drawn.out || fail "not what is found by hand"
run again 0 again/here
sed 's,again/here,pictures/here,' again.out | cmp - drawn.out || fail "other numbers the second time"
if [ -d pictures ]; then diff -r pictures again || fail "other pictures the second time"; fi
finish
