#!/bin/sh
# SPDX-License-Identifier: MIT
# A thigh of two layers: its coefficients are found again, and springs lose the volume under the pad where a solid keeps it.
#   sh check_thigh.sh path/to/thigh
program=$1
. "${0%/*}/../../check.sh"

album thigh_force thigh_volume thigh_pressed
cat drawn.out
# The coefficients that the curve was generated with lie between `from` and `to`.
awk '/^skin k|^inside/ { ++rows; if (!($(NF - 1) < $(NF - 3) && $(NF - 3) < $NF)) { print $0; bad = 1 } } END { exit bad || rows != 3 }' drawn.out ||
  fail "coefficients not found again"
# All models have 5 N at 12 mm.
awk '/^(linear|saturating|locking|two layers|solid)/ { ++rows; if ($(NF - 1) < 4.99 || $(NF - 1) > 5.01) { print $0; bad = 1 } } END { exit bad || rows != 6 }' drawn.out ||
  fail "not the same force"
# Whatever their law, springs lose from 4/5 to 6/5 of what lies under the pad, locking ones less than linear ones; the solid less than a twentieth.
awk '/^(linear|saturating|locking|two layers)/ { lost[$1] = $NF; if (!most || $NF > most) most = $NF; if (!least || $NF < least) least = $NF }
  /^solid/ { solid = $NF } /^under the pad/ { pad = $7 }
  END { exit !(least > 0.8 * pad && most < 1.2 * pad && lost["locking"] < 0.95 * lost["saturating"] && solid > 0 && solid < pad / 20) }' drawn.out ||
  fail "not the volume under the pad"
finish
