#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs the example and checks what it says of itself and writes.
#   sh check_retraction.sh path/to/retraction
program=$1
. "${0%/*}/../../check.sh"

run small 0 --out small
grep -q '^tissue  *3[0-8][0-9][0-9] tetrahedra of finite elements' small.out || fail "not 3,000 to 3,800 tetrahedra: $(cat small.out)"
grep -q '^tools  *3: two hooks, 2 of them hold' small.out || fail "the hooks do not hold: $(cat small.out)"
awk '$1 == "cut" { found = 1; if ($2 < 20 || $5 < 2) exit 1 } END { if (!found) exit 1 }' small.out || fail "no cut of 2 cm: $(cat small.out)"
awk '/above 30 Hz/ { n++; for (k = 1; k < NF; k++) { if ($k == "mean") mean = $(k + 1); if ($k == "rms") rms = $(k + 1) } if (rms > 0.02 || rms > 0.02 * mean) exit 1 } END { if (n != 3) exit 1 }' small.out ||
  fail "a hand at rest feels vibration: $(cat small.out)"
for file in left_hook.csv right_hook.csv scalpel.csv retraction.pvd retraction/retraction_0020.vtu; do [ -s "small/$file" ] || fail "no $file"; done
[ "$(head -n 1 small/scalpel.csv)" = "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J,cut_area_m2" ] || fail "header of scalpel.csv"
[ "$(wc -l <small/left_hook.csv)" -eq 4101 ] || fail "left_hook.csv has $(wc -l <small/left_hook.csv) lines"
if grep -q 'no pictures' small.err; then
  undrawn small.err
else
  for file in before drawn cutting after; do [ "$(head -c 4 "small/$file.png" | tail -c 3)" = PNG ] || fail "$file.png is no picture"; done
fi

run rate 2 --body-rate 1
run word 2 --what
[ "$failed" -eq 0 ] && echo "retraction: all checks passed"
finish
