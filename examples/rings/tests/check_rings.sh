#!/bin/sh
# SPDX-License-Identifier: MIT
# A liver of vertex rings: its table, the force on the hand and the way home are those of the closed forms.
#   sh check_rings.sh path/to/rings
program=$1
. "${0%/*}/../../check.sh"

album rings_force rings_return rings_liver
cat drawn.out
# u_r = s_r F for 1 N, and nothing beyond two rings.
awk '/^[0-3] / { ++rows; want($3, $1 == 0 ? 8 : $1 == 1 ? 4 : $1 == 2 ? 1.5 : 0, 1e-4) }
  /^the touched vertex/ { ++rows; want($(NF - 1), 1, 1e-4) }
  /^let go/ { ++rows; want($(NF - 1), 0, 1e-12) }
  /^10 mm deep/ { ++rows; want($7, 0.010 / (0.008 + 1 / 2000), 1e-3) }
  /^on the way/ { ++rows; want($7, 0, 2e-3) }
  function want(value, wanted, within) { if (value < wanted - within || value > wanted + within) { print value, "is not", wanted; bad = 1 } }
  END { exit bad || rows != 8 }' drawn.out || fail "not the closed forms"
finish
