#!/bin/sh
# SPDX-License-Identifier: MIT
# What a network does to a hand: energy within its bound in every cell, quiet, silences survived, stiffness as by the closed forms, messages saved.
#   sh check_network.sh path/to/network
program=$1
. "${0%/*}/../../check.sh"

album network_energy network_control network_silence network_stiffness network_messages network_error network_surface
cat drawn.out
awk '/^grid: [0-9]+ presses/ { ++grids; if ($2 < 24 || $2 != $4 || $10 < -1 || $14 > 0.5 || $18 > 0.5 || $22 < -1e-12) wrong("out of bounds") }
  /^grid: the hold/ { if ($8 < 11) wrong("felt too seldom") }
  / no control +[0-9]/ && $1 == 50 { ++none; if ($4 < 20 || $5 < 3) wrong("is not the instability that it shows") }
  / damped, and controller +[0-9]/ { ++damped; if ($5 > 1 || $6 > 0.5) wrong("gives energy or trembles") }
  / (up|down|both) / && $2 == "10.00" { ++ever; if ($5 > 0.25 || $7 != 0 || $8 != 0) wrong("does not vanish") }
  / down / && $2 == "0.20" { ++back; if ($6 > 0.25 || is_off($7, $4, 0.01) || is_off($8, $4, 0.01)) wrong("does not come back") }
  / (up|down|both) / && $2 == "0.40" { if ($7 != 0 || is_off($8, $4, 0.01)) wrong("is not touched anew") }
  /^ +[0-9]+ .* -> .* mm$/ { ++walls
    if (is_off($3, $4, 0.03 * $4 + 0.3) || is_off($4, $3, 0.03 * $3) || is_off($2, 0.5 / (0.0005 + $1 / 1000), 0.006)) wrong("no such stiffness")
    if ($8 >= 0.95 * $6 || $11 < 0.95 * $9 || is_off($12, 1000, 50) || $13 > 0.5) wrong("stable or unstable where it should not be")
  }
  /^deadband: a scripted/ { in_band = 1 }
  /^deadband: a hand/ { in_band = 0 }
  in_band && $1 ~ /^[0-9]+$/ { ++bands; if (bands > 1 && ($2 >= up || $3 >= down && $1 < 20)) wrong("saves nothing"); if ($8 > $1 + 0.001 || $9 > 10) wrong("is felt"); up = $2; down = $3 }
  / ball / { ++balls; if ($5 > 2) wrong("a ball is not followed") }
  / plane +(50|500) / && $1 == 0 { plane[$3] = $5 }
  /^repeats: / { if ($9 != "yes;" || $NF != "yes") wrong("not the same") }
  function is_off(value, wanted, off) { return value < wanted - off || value > wanted + off }
  function wrong(what) { print what ":", $0; bad = 1 }
  END { exit bad || grids != 1 || none != 1 || damped != 6 || ever != 3 || back != 1 || walls != 6 || bands != 6 || balls != 8 || plane[500] * 5 > plane[50] }' drawn.out ||
  fail "not what is found by hand"
finish
