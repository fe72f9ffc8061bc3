#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs the palpation small and checks what it finds, writes and refuses.
#   sh check_palpation.sh path/to/palpation
program=$1
. "${0%/*}/../../check.sh"

# refused NAME TEXT ARGUMENTS...: exit code 2 and one line with TEXT on standard error
refused() {
  text=$2
  refused_name=$1
  shift 2
  run "$refused_name" 2 --out "$refused_name" "$@"
  [ "$(wc -l <"$refused_name.err")" -eq 1 ] && grep -q -e "$text" "$refused_name.err" || fail "$refused_name: no \"$text\" in: $(cat "$refused_name.err")"
}

run small 0 --edge 0.013 --places 5 --pad 0.014 --out small
for file in palpation.csv palpation.pvd palpation/palpation_0004.vtu; do [ -s "small/$file" ] || fail "no $file"; done
[ "$(head -n 1 small/palpation.csv)" = "place_m,x_m,y_m,z_m,force_with_nodule_N,force_without_N" ] || fail "header of palpation.csv"
[ "$(wc -l <small/palpation.csv)" -eq 6 ] || fail "not five places: $(cat small/palpation.csv)"
for name in displacement stress "von Mises stress" "strain energy density" "volume ratio"; do
  grep -q "Name=\"$name\"" small/palpation/palpation_0002.vtu || fail "no $name in the series"
done
# Above the nodule it is harder than without it, and at the ends of the line it is not.
awk -F, 'NR == 4 { middle = $5 / $6 } NR == 2 || NR == 6 { if ($5 / $6 > 1.1 || $5 < $6 * 0.999) exit 1 } END { exit !(middle > 1.3) }' small/palpation.csv || fail "the nodule is not felt: $(cat small/palpation.csv)"
grep -q '^found  *at 0.0 mm of the line: .* the nodule is at 0.0 mm' small.out || fail "found: $(cat small.out)"
if grep -q 'no pictures' small.err; then
  undrawn small.err
else
  for file in force_place section; do [ "$(head -c 4 "small/$file.png" | tail -c 3)" = PNG ] || fail "$file.png is no picture"; done
fi

run soft 0 --edge 0.013 --places 3 --pad 0.014 --nodule=-0.017,0.009,0.02,0.008,5000 --out soft --no-pictures
awk -F, 'NR > 1 && ($5 / $6 > 1.000001 || $5 / $6 < 0.999999) { exit 1 }' soft/palpation.csv || fail "a nodule as soft as the organ is felt: $(cat soft/palpation.csv)"

refused far 'no tetrahedron lies within' --edge 0.02 --nodule=1,0,0,0.008,1e5
refused four 'nodule' --nodule=0,0,0,0.008
refused flat 'fourth number' --nodule=0,0,0,0,1e5
refused pascal 'fifth number' --nodule=0,0,0,0.01,1
refused pad 'give a larger --pad' --edge 0.013 --pad 0.0005 --places 3
refused depth_mm 'depth is 1 m, outside 1e-06 … 0.073[0-9]* m; in cm it would be 0.01 m, in mm it would be 0.001 m; give it in metres' --depth 1
refused pad_m 'pad is 1 m, outside' --pad 1
refused unit 'edge: 8mm is no number; give it alone, without a unit' --edge 8mm
refused nowhere 'does not exist' --mesh nowhere.stl
[ "$failed" -eq 0 ] && echo "palpation: all checks passed"
finish
