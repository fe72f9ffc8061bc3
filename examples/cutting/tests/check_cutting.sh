#!/bin/sh
# SPDX-License-Identifier: MIT
# Draws all strokes with both cutters and checks what is written, said and returned, with good and with bad arguments.
#   sh check_cutting.sh path/to/cutting path/to/check_pictures
program=$1
check_pictures=$2
. "${0%/*}/../../check.sh"

# says CUTTER NAME PATTERN: the line of a stroke
says() {
  grep "^$2 " "$1.out" | grep -q -e "$3" || fail "$1: no \"$3\" in: $(grep "^$2 " "$1.out")"
}

# refused TEXT ARGUMENTS...: exit code 2, TEXT and the usage on standard error
refused() {
  text=$1
  shift
  "$program" "$@" >refused.out 2>refused.err
  code=$?
  [ "$code" -eq 2 ] || fail "\"$*\": exit code $code instead of 2"
  grep -q -e "$text" refused.err || fail "\"$*\": no \"$text\" in: $(cat refused.err)"
  [ ! -s refused.out ] || fail "\"$*\": drew something"
}

refused "in which folder"
refused "usage:"
refused "no cutter is called \"blunt\"" pictures --cutter blunt
refused "what is \"--color\"" pictures --color
refused "what is \"--cutter\"" pictures --cutter
refused "what is \"more\"" pictures more
for width in 12 800px 4294968096 -800 nan ""; do
  refused "width is \"$width\"; a picture is 160 to 7680 pixels" pictures --width "$width"
done
: >file
refused "choose another" file
[ "$("$program" --help | head -n 1)" = "usage: cutting FOLDER [--cutter progressive|separating|volume] [--width PIXELS]" ] || fail "--help: $("$program" --help)"

strokes="straight curved crossing loop around two_blades"
for cutter in progressive separating; do
  "$program" "pictures/$cutter" --cutter "$cutter" --width 640 >"$cutter.out" 2>"$cutter.err"
  code=$?
  cat "$cutter.out"
  if [ "$code" -eq 2 ] && grep -q 'no pictures can be drawn' "$cutter.err"; then
    undrawn "$cutter.err"
    finish
  fi
  [ "$code" -eq 0 ] || fail "$cutter: exit code $code: $(cat "$cutter.err")"
  [ ! -s "$cutter.err" ] || fail "$cutter: said on standard error: $(cat "$cutter.err")"
  [ "$(wc -l <"$cutter.out")" -eq 6 ] || fail "$cutter: not six lines"
  for name in $strokes; do
    case $name in loop | around) pieces=2 ;; *) pieces=1 ;; esac
    says "$cutter" "$name" "pieces $pieces "
    says "$cutter" "$name" "invariants hold"
    awk -v name="$name" '$1 == name { for (i = 1; i < NF; ++i) if ($i == "gap") exit !($(i + 1) > 5.0) }' "$cutter.out" ||
      fail "$cutter: the wound of $name is not 5 mm open"
    "$check_pictures" "pictures/$cutter/${name}_wireframe.png" "pictures/$cutter/${name}_shaded.png" || fail "$cutter: pictures of $name"
  done
  [ "$(find "pictures/$cutter" -type f | wc -l)" -eq 12 ] || fail "$cutter: not twelve files: $(ls "pictures/$cutter")"
done
for name in $strokes; do
  says separating "$name" "triangles *+0 "
done

"$program" pictures/volume --cutter volume --width 640 >volume.out 2>volume.err || fail "volume: exit code $?: $(cat volume.err)"
cat volume.out
[ "$(wc -l <volume.out)" -eq 6 ] || fail "volume: not six lines"
for name in through partial curved crossing wedge slice; do
  case $name in wedge | slice) pieces=2 ;; *) pieces=1 ;; esac
  [ "$name" = through ] && pieces=2
  says volume "$name" "pieces $pieces "
  says volume "$name" "invariants hold"
  "$check_pictures" "pictures/volume/solid_${name}_wireframe.png" "pictures/volume/solid_${name}_shaded.png" || fail "volume: pictures of $name"
done
[ "$failed" -eq 0 ] && echo "all good"
exit "$failed"
