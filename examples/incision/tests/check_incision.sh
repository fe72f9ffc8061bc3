#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs the main job small and checks what it writes, says and returns, with good and with bad input.
#   sh check_incision.sh path/to/incision [path/to/fake/libHD.so path/to/fake/libdhd.so]
program=$1
fake_libhd=${2-}
fake_libdhd=${3-}
. "${0%/*}/../../check.sh"

# refused NAME TEXT ARGUMENTS...: exit code 2, one line with TEXT on standard error, nothing left behind
refused() {
  refused_name=$1
  text=$2
  shift 2
  run "$refused_name" 2 --out "$refused_name" --no-pictures "$@"
  lines=$(grep -c '^incision: ' "$refused_name.err")
  [ "$lines" -eq 1 ] && [ "$(wc -l <"$refused_name.err")" -eq 1 ] || fail "$refused_name: not one line: $(cat "$refused_name.err")"
  grep -q -e "$text" "$refused_name.err" || fail "$refused_name: no \"$text\" in: $(cat "$refused_name.err")"
  [ ! -e "$refused_name" ] || fail "$refused_name: left a folder behind"
}

# repaired NAME TEXT ARGUMENTS...: runs, and says in one line what it repaired
repaired() {
  repaired_name=$1
  text=$2
  shift 2
  run "$repaired_name" 0 --out "$repaired_name" --no-pictures --seconds 1 "$@"
  [ "$(grep -c '^incision: .*repaired' "$repaired_name.err")" -eq 1 ] && grep -q -e "repaired: .*$text" "$repaired_name.err" ||
    fail "$repaired_name: no \"$text\" in: $(cat "$repaired_name.err")"
}

ellipsoid >good.obj

# --- the job itself ---------------------------------------------------------------------------------------------------
run default 0 --resolution 800 --out default
for file in session.csv tissue.pvd tissue/tissue_0000.vtp; do
  [ -s "default/$file" ] || fail "default: no $file"
done
[ "$(head -n 1 default/session.csv)" = "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J" ] ||
  fail "default: header of session.csv"
for phase in "no contact" indenting moving; do
  grep -q ",$phase," default/session.csv || fail "default: session.csv is never \"$phase\""
done
if grep -q 'no pictures' default.err; then
  undrawn default.err
else
  for file in before pressed cutting after force_time force_depth energy_time; do
    [ "$(head -c 4 "default/$file.png" | tail -c 3)" = PNG ] || fail "default: $file.png is no picture"
  done
fi
[ "$(find default -name '*.part*' -o -name '.incision*' | wc -l)" -eq 0 ] || fail "default: temporary files left"
grep -q '^pieces  *1$' default.out || fail "default: not one piece: $(cat default.out)"
awk '/^wound gap/ { found = 1; exit !($3 > 1.0) } END { if (!found) exit 1 }' default.out || fail "default: no gap above 1 mm: $(cat default.out)"
grep -q 'DIVERGED' default.out && fail "default: the body diverged"

run again 0 --resolution 800 --out again --no-pictures
cmp -s default/session.csv again/session.csv || fail "two runs differ in session.csv"
run noise 0 --resolution 800 --out noise --no-pictures --seed 8
cmp -s default/session.csv noise/session.csv && fail "another seed gives the same session.csv"

run version 0 --version
grep -q '^incision (palpate [0-9.]*)$' version.out || fail "version: $(cat version.out)"
run zone 0 --resolution 600 --zone 3 --integrator rk4 --coupling tight --out zone --no-pictures
run mesh 0 --mesh good.obj --unit cm --out mesh --no-pictures
grep -q '^incision' mesh.err && fail "mesh: said something about a good mesh: $(cat mesh.err)"
run realtime 0 --resolution 600 --realtime --seconds 1 --out realtime --no-pictures

# --- a solid ----------------------------------------------------------------------------------------------------------
# The run that cuts, and the same begun again: up to there to the byte. It costs the hand no less than the toughness times the area, both from the file.
run solid 0 --tissue fem --young 4000 --poisson 0.4 --edge 0.016 --toughness 50 --resolution 600 --out solid
run solid_again 0 --tissue fem --young 4000 --poisson 0.4 --edge 0.016 --toughness 50 --resolution 600 --seconds 2 --out solid_again --no-pictures
head -n 2000 solid/session.csv | cut -d, -f1-10 >solid.first
head -n 2000 solid_again/session.csv | cut -d, -f1-10 | cmp -s solid.first - || fail "two runs of a solid differ in session.csv"
grep -q '^tissue  *finite elements, stable neo-Hooke, E 4000 Pa, nu 0.4; edge 16.00 mm' solid.out || fail "solid: $(cat solid.out)"
awk '/^cut / { found = 1; exit !($2 > 3 && $2 < 40) } END { if (!found) exit 1 }' solid.out || fail "solid: not cut: $(cat solid.out)"
awk '/^wound gap/ { found = 1; exit !($3 > 0.5) } END { if (!found) exit 1 }' solid.out || fail "solid: no gap above 0.5 mm: $(cat solid.out)"
grep -q '^pieces  *1$' solid.out || fail "solid: not one piece: $(cat solid.out)"
awk -F, 'NR == 1 && $11 != "cut_area_m2" { bad = 1 } NR > 1 { energy = $10; area = $11 } END { exit !(!bad && area > 3e-4 && energy >= 50 * area) }' solid/session.csv ||
  fail "solid: the area cost the hand less than the toughness: $(tail -n 1 solid/session.csv)"
grep -q '^filled  *[0-9]* tetrahedra, .* dihedral angles' solid.out || fail "solid: not what it was filled with: $(cat solid.out)"
grep -q '^steps  *implicit, of any size; conjugate gradients [0-9.]* iterations' solid.out || fail "solid: no iterations: $(cat solid.out)"
awk '/^largest force/ { found = 1; exit !($3 > 0.05 && $3 < 3) } END { if (!found) exit 1 }' solid.out || fail "solid: nothing felt: $(cat solid.out)"
run solid_explicit 0 --tissue fem --edge 0.018 --seconds 1 --integrator leapfrog --out solid_explicit --no-pictures
grep -q '^steps  *explicit, stable up to [0-9.]* ms' solid_explicit.out || fail "solid: no stable step: $(cat solid_explicit.out)"

# --- a device, or what stands in for its library ----------------------------------------------------------------------
if [ -n "$fake_libhd" ]; then
  export PALPATE_LIBHD="$fake_libhd"
  for k in 1 2; do run "device$k" 0 --device hd: --resolution 800 --out "device$k" --no-pictures; done
  grep -q '^device  *Touch, not a real one' device1.out || fail "device: $(cat device1.out)"
  awk '/^cut / { exit !($2 > 20 && $2 < 60) }' device1.out || fail "device: the hand does not cut: $(cat device1.out)"
  cmp -s device1/session.csv device2/session.csv || fail "two runs on a device with a virtual clock differ in session.csv"
  run device_realtime 0 --device hd: --realtime --resolution 600 --seconds 1 --out device_realtime --no-pictures
  PALPATE_FAKE_LIBHD_CLOCK=real
  export PALPATE_FAKE_LIBHD_CLOCK
  run device_clock 0 --device hd: --resolution 600 --seconds 1 --out device_clock --no-pictures
  unset PALPATE_FAKE_LIBHD_CLOCK
  grep -q '^rates  *servo .* Hz (' device_clock.out || fail "device_clock: not in real time: $(cat device_clock.out)"
  unset PALPATE_LIBHD
fi
if [ -n "$fake_libdhd" ]; then
  PALPATE_LIBDHD=$fake_libdhd
  export PALPATE_LIBDHD
  run delta 0 --device dhd: --resolution 600 --seconds 1 --out delta --no-pictures
  grep -q '^device  *.*libdhd' delta.out || fail "delta: $(cat delta.out)"
  grep -q '^rates  *servo .* Hz (' delta.out || fail "delta: not in real time: $(cat delta.out)"
fi
PALPATE_LIBDHD=/nowhere/libdhd.so
export PALPATE_LIBDHD
refused solid_deep 'is pressed no deeper than 0.0056 m' --tissue fem --edge 0.008 --puncture-depth 0.01
refused springs_tough 'add --tissue fem' --toughness 100
refused solid_zone 'a solid has none' --tissue fem --zone 3
refused solid_rk4 'backward-euler or leapfrog' --tissue fem --integrator rk4
refused springs_young 'add --tissue fem' --young 100
refused springs_implicit 'goes with --tissue fem' --integrator backward-euler
refused solid_fine 'give an edge above' --tissue fem --edge 0.00001
refused no_libdhd "/nowhere/libdhd.so: cannot open" --device dhd:
unset PALPATE_LIBDHD
PALPATE_LIBHD=/nowhere/libHD.so
export PALPATE_LIBHD
refused no_libhd "libHD could not be loaded: /nowhere/libHD.so: cannot open" --device hd:
unset PALPATE_LIBHD
# Down into the organ and out again, along the surface's normal, by a hand of numbers that gives way.
printf 'time_s,x_m,y_m,z_m\n0,0,0.02,0\n0.5,0,-0.01,0\n1,0,0.02,0\n' >poke.csv
run hand 0 --device "sim:hand?hand=firm&path=poke.csv" --resolution 600 --seconds 1 --out hand --no-pictures
grep -q ",indenting," hand/session.csv || fail "hand: it never presses: $(cat hand.out)"
run touch 0 --device "sim:touch?hand=firm&path=poke.csv" --resolution 600 --seconds 1 --out touch --no-pictures
grep -q '^device  *simulated Touch' touch.out || fail "touch: $(cat touch.out)"
refused no_name "nothing is called omni; there are dhd:INDEX, hd:NAME, null:, replay:FILE, script:FILE.csv, sim:hand, sim:touch" --device omni:
refused no_colon "has no colon" --device omni
refused no_option "sim:hand has no option speed" --device "sim:hand?speed=3"
refused no_replay "nowhere.bin" --device replay:nowhere.bin

# --- meshes that are repaired, with a word about it -------------------------------------------------------------------
{ cat good.obj; echo "v 9 9 9"; } >unused.obj
repaired unused "1 unused vertex" --mesh unused.obj --unit cm
# The vertex of the last face's first corner once more, and the last face on the copy.
awk '{ line[NR] = $0 } /^v / { v[++n] = $0 } END {
  split(line[NR], f, " ")
  for (i = 1; i < NR; ++i) print line[i]
  print v[f[2]]
  print "f", n + 1, f[3], f[4]
}' good.obj >duplicate.obj
repaired duplicate "1 duplicate vertex" --mesh duplicate.obj --unit cm
{ cat good.obj; echo "f 1 2 2"; } >degenerate.obj
repaired degenerate "1 degenerate element" --mesh degenerate.obj --unit cm

# --- input that is refused --------------------------------------------------------------------------------------------
{ cat good.obj; echo "v 0 0 9"; echo "f 1 2 $(($(grep -c '^v ' good.obj) + 1))"; } >fin.obj
refused fin "3 triangles" --mesh fin.obj --unit cm
head -c 9000 good.obj >cut_vertices.obj
refused cut_vertices "cut short\|no triangles" --mesh cut_vertices.obj --unit cm
head -c "$(($(wc -c <good.obj) - 700))" good.obj >cut_faces.obj
refused cut_faces "cut short\|border\|hole" --mesh cut_faces.obj --unit cm
: >empty.obj
refused empty "the file is empty" --mesh empty.obj
sed '10s/.*/v 1 nan 0/' good.obj >nan.obj
refused nan "not a finite number" --mesh nan.obj --unit cm
refused missing "the file does not exist" --mesh missing.stl
refused kind "not a known kind of mesh file" --mesh "$0"

# --- another unit than the one that is read: the message names the likely one ------------------------------------------
# The ellipsoid's diagonal is 14.1 cm; its volume 502.7 cm3, 0.53 kg of tissue.
refused metres "diagonal is 14.1 m, outside 0.001 … 2 m; in cm it would be 0.141 m, in mm it would be 0.0141 m; say with --unit" --mesh good.obj
awk '$1 == "v" { print $1, 10 * $2, 10 * $3, 10 * $4; next } { print }' good.obj >millimetres.obj
refused millimetres "diagonal is 141 m, .*in mm it would be 0.141 m; say with --unit" --mesh millimetres.obj
awk '$1 == "v" { print $1, $2 / 100, $3 / 100, $4 / 100; next } { print }' good.obj >metres.obj
refused tiny "with --unit mm .* is 0.000141 m, .*; in m it would be 0.141 m, in cm it would be 0.00141 m;" --mesh metres.obj --unit mm
refused depth_mm "puncture-depth is 18 m, .*; in mm it would be 0.018 m; give it in metres" --mesh good.obj --unit cm --puncture-depth 18
refused depth_one "puncture-depth is 1 m, .*; in cm it would be 0.01 m, in mm it would be 0.001 m;" --puncture-depth 1
refused mass_grams "mass is 530 kg .*; in g it would be 0.53 kg; give it in kilograms" --mesh good.obj --unit cm --mass 530

path() { printf 'time_s,x_m,y_m,z_m\n%s\n' "$1"; }
path "0,0,0,0.2
1,0.1,0,0.2" >far.csv
refused far "never touches" --tool far.csv
refused default_too_short "liver: a run of 0.05 s is too short: the path touches the organ at 0..* s; give a larger --seconds, or none" --resolution 800 --seconds 0.05
refused far_too_short "never touches" --tool far.csv --seconds 0.5
path "0,0,0,0
1,0,0,0.2" >inside.csv
refused inside "inside the organ" --mesh good.obj --unit cm --tool inside.csv
path "0,0,0,0.2
2,0,0,0.1
1,0,0,0.02" >backwards.csv
refused backwards "line 4" --tool backwards.csv
path "0,0,0,60
1,0,0,20" >path_mm.csv
refused path_mm "at 0 s the distance .* is 60 m, .*in mm it would be 0.06 m; write the path in metres" --mesh good.obj --unit cm --tool path_mm.csv
path "" >nothing.csv
refused nothing "rows" --tool nothing.csv
refused no_tool "no_tool.csv" --tool no_tool.csv
run device 0 --resolution 600 --device null: --seconds 0.05 --out device --no-pictures   # no path of the script's
[ "$(wc -l <device/session.csv)" -eq 51 ] || fail "device: $(wc -l <device/session.csv) lines of 50 ticks"
path "0,0,0,0.06
1e9,0,0,0.02" >ages.csv
refused ages "at most 3600 s" --mesh good.obj --unit cm --tool ages.csv
run some_of_ages 2 --mesh good.obj --unit cm --tool ages.csv --seconds 1 --out some_of_ages --no-pictures
grep -q "a run of 1 s is too short: the path touches the organ at 80[0-9]*00000 s; let the path do so within 3600 s" some_of_ages.err || fail "some_of_ages: $(cat some_of_ages.err)"
path "0,0,0,0.06
1,0,0,0.02
2,0.02,0,0.02
3,0.02,0,0.06" >stroke.csv
refused too_short "a run of 0.5 s is too short: the path touches the organ at 0.[78].* s; give a larger --seconds, or none" --mesh good.obj --unit cm --tool stroke.csv --seconds 0.5
run tool 0 --mesh good.obj --unit cm --tool stroke.csv --out tool --no-pictures
grep -q '^cut  *[1-9]' tool.out || fail "tool: the path does not cut: $(cat tool.out)"
# 2 cm along the dome of a 10 cm ellipsoid, give or take the way in and out and an edge of the mesh.
awk '/^cut / { exit !($2 > 15 && $2 < 35) }' tool.out || fail "tool: the cut is not 2 cm long: $(cat tool.out)"
path "0,0,0,0.06
1,0,0,0.02
2,0.01,0,0.02
2.4,0,0,0.01
2.6,0,0,-0.06
4,0,0,-0.08" >through.csv
run through 0 --mesh good.obj --unit cm --tool through.csv --out through --no-pictures
grep -q '^note .*came out of the organ' through.out || fail "through: no word of it: $(cat through.out)"
[ "$(tail -n 1 through/session.csv | cut -d, -f6)" = "no contact" ] || fail "through: still in contact: $(tail -n 1 through/session.csv)"
run slack 0 --mesh good.obj --unit cm --tool stroke.csv --prestrain 0 --out slack --no-pictures
grep -q '^wound gap .*does not open' slack.out || fail "slack: no word of the closed wound: $(cat slack.out)"
run stiff 0 --link-stiffness 1000 --out stiff --no-pictures
grep -q 'DIVERGED' stiff.out && fail "stiff: the body diverged"
# The hand of the script moves smoothly: no step of the speed above 2 mm/s within a millisecond.
awk -F, 'NR > 1 { for (k = 2; k <= 4; ++k) { v[k] = ($k - p[k]) * 1000; p[k] = $k }
  if (NR > 3) { d = 0; for (k = 2; k <= 4; ++k) d += (v[k] - o[k])^2; if (sqrt(d) > 0.002 && $6 == "moving") bad = $1 }
  for (k = 2; k <= 4; ++k) o[k] = v[k] } END { if (bad) { print "a jump of the speed at", bad; exit 1 } }' default/session.csv ||
  fail "default: the scripted hand jumps"

echo "a file" >file
for out in file/below /proc/incision-out; do
  run folder 2 --resolution 600 --seconds 1 --no-pictures --out "$out"
  [ "$(wc -l <folder.err)" -eq 1 ] || fail "folder $out: not one line: $(cat folder.err)"
  grep -q "output folder" folder.err || fail "folder $out: $(cat folder.err)"
done
for wrong in "--unit inch" "--integrator magic" "--resolution 3" "--prestrain 2" "--no-such-option" "--seconds nan" "--seed -1" "--seed 18446744073709551616" "--seed 010" "--mass nan" "--device omni" "--device hd: --tool x.csv"; do
  # shellcheck disable=SC2086
  run option 2 $wrong
  [ "$(wc -l <option.err)" -eq 1 ] || fail "option $wrong: not one line: $(cat option.err)"
done
refused a_unit "young: 5kPa is no number; give it alone, without a unit" --tissue fem --young 5kPa
refused a_fraction "zone: 2.5 is no whole number" --zone 2.5
refused a_crowd "resolution: Value 99999999999 not in range 500 to 100000" --resolution 99999999999
refused words "not expected: --bogus one two (see" --bogus one two
refused words_between "not expected: one --bogus two (see" one --seed 3 --bogus two

# --- no display to draw on --------------------------------------------------------------------------------------------
mkdir empty_path
DISPLAY='' PATH="$folder/empty_path" "$program" --resolution 600 --seconds 1 --out undrawn >undrawn.out 2>undrawn.err
code=$?
[ "$code" -eq 0 ] || fail "undrawn: exit code $code"
[ -s undrawn/session.csv ] || fail "undrawn: no session.csv"
[ "$(grep -c 'no pictures' undrawn.err)" -eq 1 ] || [ -s undrawn/after.png ] || fail "undrawn: $(cat undrawn.err)"

[ "$failed" -eq 0 ] && echo "incision: all checks passed"
finish
