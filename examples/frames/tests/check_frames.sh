#!/bin/sh
# SPDX-License-Identifier: MIT
# The chain of frames is the product of the matrices, the hand does the work that the tissue takes, and a clutch does not move the tip.
#   sh check_frames.sh path/to/frames
program=$1
. "${0%/*}/../../check.sh"

run numbers 0
cat numbers.out
# value LINE FIELD: of the line that begins so
value() { awk -v begin="$1" -v field="$2" 'index($0, begin) == 1 { print $(field < 0 ? NF + 1 + field : field) }' numbers.out; }
same() { awk -v a="$1" -v b="$2" -v tolerance="$3" 'BEGIN { d = a - b; exit !(a ~ /^-?[0-9.e+-]+$/ && b ~ /^-?[0-9.e+-]+$/ && d < tolerance && d > -tolerance) }' || fail "$4: $1 and $2"; }
same "$(value difference 2)" 0 1e-15 "the chain is not the matrices' product"
same "$(value 'power that the tissue takes' -2)" "$(value 'power of the hand' -2)" 1e-6 "work"
same "$(value '100 N/m in the scene are felt as' -6)" "$(value '100 N/m in the scene are felt as' -4)" 1e-4 "felt stiffness"
same "$(value 'tip after three strokes' -10)" "$(value 'tip after three strokes' -8)" 1e-4 "the clutch"
same "$(value 'the tip never jumps' -10)" "$(value 'the tip never jumps' -5)" 1e-6 "a jump"
album frames_clutch
finish
