#!/bin/sh
# SPDX-License-Identifier: MIT
# A palpated heart: its counts, the balance of its forces, and what a zone leaves out. Rates are printed, not judged.
#   sh check_heart.sh path/to/heart
program=$1
. "${0%/*}/../../check.sh"

album heart_force heart_facets heart_smooth
cat drawn.out
# The thesis has 961 nodes; a closed surface without handles has 2V - 4 triangles and 3V - 6 edges.
grep -q '^heart: 961 nodes, 1918 triangles, 2877 edges' drawn.out || fail "not the heart: $(head -n 1 drawn.out)"
grep -q 'not sound' drawn.out && fail "the body is not sound"
# At rest the home springs hold what the finger pushes. A zone, whose border does not move, is stiffer the fewer rings it has.
awk '/^whole body / { ++rows; whole = $3 }
  /^three rings/ { ++rows; three = $3 }
  /^two rings/ { ++rows; two = $3 }
  /^one ring/ { ++rows; one = $3 }
  /^balance/ { ++rows; if ($(NF - 8) - $(NF - 1) > 1.1e-4 || $(NF - 1) - $(NF - 8) > 1.1e-4 || !($(NF - 1) > 0.01)) bad = 1 }
  END { exit bad || rows != 5 || !(whole <= three && three < two && two < one) }' drawn.out || fail "the forces do not balance"
# Zheng 2006: ring 1 follows weakly, ring 2 almost not.
awk '/mean displacement/ { gsub(",", ""); found = 1; exit !($6 > 7.9 && $6 < 8.1 && $9 < 0.6 * $6 && $12 < 0.5 * $9 && $15 < $12) } END { if (!found) exit 1 }' drawn.out ||
  fail "the rings do not follow as published"
finish
