#!/bin/sh
# SPDX-License-Identifier: MIT
# Draws all pictures of docs/rendering.md and looks at what is written, said and returned.
#   sh check_haptics.sh path/to/haptics
program=$1
. "${0%/*}/../../check.sh"

draws haptics bounces restitution controller_position controller_energy moving_average late_force patches palpating palpating_energy safety

# Numbers against what they are by hand.
says '0.1 N s/m: stable up to 200.0 N/m'              # 2 b/T
says '5000 N/m: from a sample 1.219'                  # printed to four digits by an independent program, as the next two
says 'plane, at once .* jump 0.44'
says 'ball, over 33 ms .* largest step 0.0026 N'      # K d v T/(R - d) = 0.00263
says 'mean of  2: 501\.. N/m, tried 501'              # b/T
says 'mean of 10: 101\.. N/m, tried 101'              # 0.2 b/T
says 'limits: 0.88 N, 500 N/s'
says '0.25. s: armed'                                 # the wanted force falls below 0.2 N at 0.248 s
says 'firm hand .* at least 0.0000 mJ'
awk '/N\/m: from a sample/ && !($(NF - 3) + 0 <= $NF) { exit 1 }' out || fail "the controlled wall throws back faster than one that is not sampled: $(grep 'from a sample' out)"
awk '/^  controlled taken/ { exit !($3 > -0.1) }' out || fail "the controlled wall has given energy: $(grep taken out)"

wants_one_folder haptics

[ "$failed" -eq 0 ] && echo "passed"
exit "$failed"
