#!/bin/sh
# SPDX-License-Identifier: MIT
# A liver of cubes: Young's modulus and Poisson's ratio of a bar, breadth first needs fewer visits, splits and joins, a cut that gapes.
#   sh check_cubes.sh path/to/cubes
program=$1
. "${0%/*}/../../check.sh"

album cubes_orders cubes_pressed cubes_cut
cat drawn.out
awk '/^a bar/ { ++rows; want($8, 5000, 1); want($NF, 0.25, 1e-3) }
  /visits to/ { ++rows; visits[++n] = $(NF - 4) }
  /^liver/ { ++rows; want($6, 1, 0.05) }
  /^pressed/ { ++rows; cubes = $6 + 0; want($2 > cubes, 1, 0) }
  /^left/ { ++rows; want($2, cubes, 0) }
  /^cut/ { ++rows; want($2 > 20, 1, 0); want($(NF - 1) > 0.3, 1, 0) }
  function want(value, wanted, within) { if (value < wanted - within || value > wanted + within) { print value, "is not", wanted; bad = 1 } }
  END { exit bad || rows != 8 || !(visits[1] < visits[2]) || !(visits[1] < visits[3]) }' drawn.out || fail "not the numbers expected"
finish
