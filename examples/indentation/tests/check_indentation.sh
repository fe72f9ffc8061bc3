#!/bin/sh
# SPDX-License-Identifier: MIT
# The solid's punch is near the closed form where that holds, and the residual is what one modulus cannot say.
#   sh check_indentation.sh path/to/indentation
program=$1
. "${0%/*}/../../check.sh"

album indentation_curve indentation_modulus
cat drawn.out
# Yardstick: Boussinesq's flat punch on a half-space; sticking and a block of finite height make it harder, by less than 15 %.
awk '/^flat punch/ { exit !($6 > 1.0 && $6 < 1.15) }' drawn.out || fail "not the flat punch"
# A curve that stiffens asks for a larger modulus the deeper it is fitted, and is met worse.
awk '/mm/ && NF == 5 && $2 == "mm" && $5 < 5 { if (!($3 > modulus && $4 > rms)) bad = 1; modulus = $3; rms = $4; ++rows } END { exit bad || rows != 4 }' drawn.out ||
  fail "the fits do not stiffen"
# The first residuals are above the curve, the last below it.
awk '/ 1.0 mm .* [0-9]+$/ && NF == 6 { first = $5 } / 5.0 mm .* [0-9]+$/ && NF == 6 { last = $5 } END { exit !(first > 0.3 && last < -0.5) }' drawn.out || fail "residuals"
# The other fit, of a vertex on a mesh as wide as the probe, agrees within a fifth.
awk '/^fit_stiffness/ { fit = $6 } / 4.0 mm/ && NF == 5 { punch = $3 } END { exit !(fit > 0.8 * punch && fit < 1.2 * punch) }' drawn.out || fail "the two fits differ"
finish
