#!/bin/sh
# SPDX-License-Identifier: MIT
# Draws all pictures of docs/forces.md and looks at what is written, said and returned.
#   sh check_forces.sh path/to/forces
program=$1
. "${0%/*}/../../check.sh"

draws forces contact hunt_crossley puncture liver_loop guard blade speed_network organ_depth organ_speed noise_spectrum noise_time needle

# Numbers against what they are by hand.
says 'spring .* 3.000 N at 18 mm'                      # the published datum
says 'widest 0.301 N at 20.2'                          # of the published loop
says 'default  *3.000 N at the puncture'
says 'the cap is met at 5.5 mm'                        # 11 N s/m over 2000 N s/m^2
says "the thesis's 1.8e5 N s/m^2 at 10 mm and 20 mm/s: 36 N"
says 'damper 0.400 N, capped 0.220 N, friction 0.072 N'   # 2000 d v, 11 v, 180 d x/sqrt(1 + x^2) with x = 0.04
says 'slice-push 1 .* force factor 0.500'              # 1/(1 + 1)
awk '/white .* mN/ { exit !($3 > 31.3 && $3 < 31.9) }' out || fail "the noise is not 10^(-30/20) of 1 N: $(grep white out)"

wants_one_folder forces
echo "a file" >file
for place in file file/below /proc/forces; do
  "$program" "$place" >wrong.out 2>wrong.err
  [ $? -eq 2 ] && grep -q 'choose another' wrong.err || fail "$place: $(cat wrong.err)"
done

[ "$failed" -eq 0 ] && echo "passed"
exit "$failed"
