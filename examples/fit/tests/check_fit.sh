#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs palpate-fit and checks what it writes, says and returns, with good and with bad input.
#   sh check_fit.sh path/to/palpate-fit path/to/examples/fit
program=$1
shipped=$2
. "${0%/*}/../../check.sh"

# refused NAME TEXT ARGUMENTS...: exit code 2, one line with TEXT on standard error, nothing left behind
refused() {
  refused_name=$1
  text=$2
  shift 2
  run "$refused_name" 2 --out "$refused_name" "$@"
  [ "$(grep -c '^palpate-fit: ' "$refused_name.err")" -eq 1 ] && [ "$(wc -l <"$refused_name.err")" -eq 1 ] ||
    fail "$refused_name: not one line: $(cat "$refused_name.err")"
  grep -q -e "$text" "$refused_name.err" || fail "$refused_name: no \"$text\" in: $(cat "$refused_name.err")"
  [ ! -e "$refused_name" ] || fail "$refused_name: left something behind"
}

# coefficient FILE NAME TRUE: the interval in the table holds the value that the measurements were made with
coefficient() {
  awk -v name="$2" -v true="$3" '$1 == name { for (k = 1; k < NF; ++k) if ($k == "between") { low = $(k + 1); high = $(k + 3) } }
    END { exit !(low != "" && low <= true && true <= high) }' "$1" || fail "$1: $2 does not hold $3: $(grep "^  $2 " "$1")"
}

# --- the data sets that are shipped are what the program writes -------------------------------------------------------
for which in liver needle; do
  run "generate_$which" 0 --generate "$which"
  cmp "generated_$which.csv" "$shipped/generated_$which.csv" || fail "generated_$which.csv is not what palpate-fit --generate $which writes"
  head -n 1 "generated_$which.csv" | grep -q 'not measured' || fail "generated_$which.csv does not say that nobody measured it"
done
run elsewhere 0 --generate liver --out elsewhere.csv
cmp -s elsewhere.csv generated_liver.csv || fail "--generate writes another text with --out"

# --- one model --------------------------------------------------------------------------------------------------------
run needle 0 generated_needle.csv --model needle --source 'generated, "made up"' --out needle
for truth in "a1 40" "a2 6000" "cutting 0.4" "dynamic 20" "viscous 500"; do
  # shellcheck disable=SC2086
  coefficient needle.out $truth
done
# The noise that was put on the forces is 0.02 N; of 228 measurements and five coefficients the residual is within a tenth of it.
awk '$1 == "residual" { found = 1; exit !($2 > 0.018 && $2 < 0.022) } END { if (!found) exit 1 }' needle.out ||
  fail "needle: residual: $(cat needle.out)"
grep -q '"source": "generated, \\"made up\\""' needle/force.json || fail "needle: no source in force.json"
if grep -q 'no pictures' needle.err; then
  undrawn needle.err
else
  for file in fit residuals; do
    [ "$(head -c 4 "needle/$file.png" | tail -c 3)" = PNG ] || fail "needle: $file.png is no picture"
  done
fi
run again 0 generated_needle.csv --model needle --source 'generated, "made up"' --out again --no-pictures
cmp -s needle/force.json again/force.json || fail "two runs differ in force.json"
[ ! -e again/fit.png ] || fail "again: a picture in spite of --no-pictures"
run narrow 0 generated_needle.csv --model needle --confidence 0.5 --out again --no-pictures
grep -q ', 50 % between' narrow.out || fail "narrow: $(cat narrow.out)"

for model in linear polynomial exponential hunt-crossley network; do
  run "one_$model" 0 generated_liver.csv --model "$model" --out "one_$model" --no-pictures
  run "check_$model" 0 --check "one_$model/force.json"
  grep -q 'not finite' "check_$model.out" && fail "check_$model: $(cat "check_$model.out")"
done
grep -q 'No force of this library is validated' one_network.out || fail "one_network: says nothing of validation"
# What the simulator felt of the needle: a1 d + a2 d^2 at the puncture, 6 mm, is 0.46 N, f_c + (C + b v) d at 12 mm and 10 mm/s 0.70 N.
run check_needle 0 --check needle/force.json
awk '/before the puncture/ { b = $4 } /after it/ { a = $3 } END { exit !(b > 0.44 && b < 0.48 && a > 0.68 && a < 0.72) }' check_needle.out ||
  fail "check_needle: $(cat check_needle.out)"
run seeded 0 generated_liver.csv --model network --seed 5 --out seeded --no-pictures
cmp -s seeded/force.json one_network/force.json && fail "another seed gives the same network"
grep -v '^#' generated_liver.csv | grep -v unloading >one_way.csv
run one_way 0 one_way.csv --model network --out one_way_out --no-pictures
grep -q '16 weights' one_way.out || fail "one_way: not a network of depth alone: $(cat one_way.out)"
run undetermined 0 generated_liver.csv --model needle --out undetermined --no-pictures
grep -q 'do not say what a1, a2' undetermined.err || fail "undetermined: no word of it: $(cat undetermined.err)"

# --- all of them ------------------------------------------------------------------------------------------------------
run all 0 generated_liver.csv --out all
for model in linear polynomial exponential hunt-crossley network; do
  [ -s "all/force_$model.json" ] || fail "all: no force_$model.json"
done
[ ! -e all/force_needle.json ] || fail "all: a needle was fitted to a liver"
grep -q '^Left out: needle: ' all.out || fail "all: no word of the needle"
# The liver's curve is no power of the depth: the interval of Hunt and Crossley's k reaches below zero.
grep -q '^  k .* between -.*: not determined by these measurements$' all.out || fail "all: an interval that holds zero is not told: $(cat all.out)"
grep -q 'do not say what k of the model "hunt-crossley" is' all.err || fail "all: no word of hunt-crossley's k: $(cat all.err)"
awk '/left out \[N\]/ { table = 1; next } table && /^  / { if ($2 + 0 < last) exit 1; last = $2; ++rows } END { exit rows != 5 }' all.out ||
  fail "all: not sorted by the cross-validated error: $(cat all.out)"
grep -A 1 'left out \[N\]' all.out | grep -q '^  network ' || fail "all: the network is not the best for its own curve"
[ "$(find . -name '*.part*' | wc -l)" -eq 0 ] || fail "temporary files left"

# --- input that is refused --------------------------------------------------------------------------------------------
refused missing "does not exist" missing.csv
: >empty.csv
refused empty "the file is empty" empty.csv
sed 's/indenting/pushing/' generated_needle.csv >pushing.csv
refused pushing 'line 7: the phase is "pushing"' pushing.csv
sed '20s/,[^,]*$/,nan/' generated_needle.csv >nan.csv
refused nan "line 20" nan.csv
# The liver's depths, 0.5 to 22.5 mm, in millimetres: the first beyond 0.3 m is the first of 0.5.
awk -F, -v OFS=, '/^#/ || /^depth/ { print; next } { $1 *= 1000; print }' generated_liver.csv >millimetres.csv
refused millimetres "line [0-9]*: the depth is [0-9.]* m, outside 0 … 0.3 m; .*in mm it would be 0.000[0-9]* m; write depths in metres" millimetres.csv
head -n 7 generated_liver.csv >few.csv
refused few "at least 4" few.csv --model polynomial
refused few_for_a_network "21 weights\|16 weights" few.csv --model network
refused no_model "magic" generated_liver.csv --model magic
refused share "between 0 and 1" generated_liver.csv --confidence 1.5
refused no_share "between 0 and 1" generated_liver.csv --confidence nan
refused seed "a whole number" generated_liver.csv --seed -1
refused seed_large "a whole number" generated_liver.csv --seed 18446744073709551616
refused words "not expected: --bogus --other two (see" generated_liver.csv --bogus --other two
refused nothing "give a file of measurements"
refused both "one of them" generated_liver.csv --check needle/force.json
refused no_data "heart" --generate heart
refused no_force "does not exist" --check missing.json
refused csv_as_force "generated_liver.csv" --check generated_liver.csv
sed 's/"a1"/"a9"/' needle/force.json >a9.json
refused unknown_coefficient "a1" --check a9.json

echo "a file" >file
for out in file/below /proc/palpate-fit-out; do
  run folder 2 generated_liver.csv --model linear --out "$out"
  [ "$(wc -l <folder.err)" -eq 1 ] && grep -q "output folder" folder.err || fail "folder $out: $(cat folder.err)"
  run folder 2 --generate liver --out "$out/liver.csv"
  [ "$(wc -l <folder.err)" -eq 1 ] && grep -q "create it first" folder.err || fail "folder $out: $(cat folder.err)"
done

run version 0 --version
grep -q '^palpate-fit (palpate [0-9.]*)$' version.out || fail "version: $(cat version.out)"
run help 0 --help

# --- no display to draw on --------------------------------------------------------------------------------------------
mkdir empty_path
DISPLAY='' PATH="$folder/empty_path" "$program" generated_liver.csv --model linear --out undrawn >undrawn.out 2>undrawn.err
code=$?
[ "$code" -eq 0 ] && [ -s undrawn/force.json ] && [ ! -e undrawn/fit.png ] || fail "undrawn: exit code $code"
[ "$(wc -l <undrawn.err)" -eq 1 ] && grep -q 'no pictures' undrawn.err || fail "undrawn: $(cat undrawn.err)"

[ "$failed" -eq 0 ] && echo "passed"
finish
