# SPDX-License-Identifier: MIT
# What the checks of the examples share. Each begins with: program=$1; . "${0%/*}/../../check.sh"
# They then work in a folder that is removed at the end, and exit with $failed.
set -u
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
failed=0
skipped=0

fail() {
  echo "FAILED: $*"
  failed=1
}

# undrawn FILE: the program says in FILE that no pictures can be drawn. What looks at them is skipped; where CI=true that is a failure.
undrawn() {
  echo "SKIPPED: $(cat "$1")"
  skipped=77
  [ "${CI-}" != true ] || fail "must not be skipped in CI"
}

# The exit code: 77, which ctest shows as Skipped, where nothing failed but something was skipped.
finish() {
  [ "$failed" -eq 0 ] && exit "$skipped"
  exit "$failed"
}

# run NAME EXPECTED_CODE ARGUMENTS...: keeps NAME.out and NAME.err
run() {
  name=$1
  expected=$2
  shift 2
  "$program" "$@" >"$name.out" 2>"$name.err"
  code=$?
  [ "$code" -eq "$expected" ] || fail "$name: exit code $code instead of $expected: $(cat "$name.err")"
}

# draws PREFIX NAME...: runs the program for a folder of pictures; each PREFIX_NAME has to be there, small and named, and no other. Leaves out and err.
draws() {
  prefix=$1
  shift
  "$program" pictures/here >out 2>err
  code=$?
  if grep -q 'no pictures can be drawn' err; then
    undrawn err
    finish
  fi
  [ "$code" -eq 0 ] || fail "exit code $code: $(cat err)"
  for name; do
    file=pictures/here/${prefix}_$name.png
    [ "$(head -c 4 "$file" | tail -c 3)" = PNG ] || fail "$file is no picture"
    [ "$(wc -c <"$file")" -lt 61440 ] || fail "$file is larger than 60 kB"
    grep -q "^${prefix}_$name\$" out || fail "$name: not named: $(cat out)"
  done
  [ "$(find pictures -name '*.png' | wc -l)" -eq $# ] || fail "not $# pictures: $(ls pictures/here)"
  [ "$(find . -name '*.part*' | wc -l)" -eq 0 ] || fail "temporary files left"
}

# says PATTERN: what was drawn last was printed with this.
says() { grep -q -e "$1" out || fail "no \"$1\" in: $(cat out)"; }

# wants_one_folder NAME: anything else is refused with the usage.
wants_one_folder() {
  for wrong in "" "--what" "one two"; do
    # shellcheck disable=SC2086
    "$program" $wrong >wrong.out 2>wrong.err
    [ $? -eq 2 ] && grep -q "usage: $1 FOLDER" wrong.err || fail "\"$wrong\": $(cat wrong.err)"
  done
}

# ellipsoid: one of 10 x 8 x 6 cm, in centimetres, as an OBJ file: rings of vertices between two poles, faces outward.
ellipsoid() {
  awk 'BEGIN {
    n = 28; m = 14; pi = 3.14159265358979
    print "v 0 0 3"
    for (i = 1; i < m; ++i) for (j = 0; j < n; ++j)
      printf "v %.6f %.6f %.6f\n", 5*sin(pi*i/m)*cos(2*pi*j/n), 4*sin(pi*i/m)*sin(2*pi*j/n), 3*cos(pi*i/m)
    print "v 0 0 -3"
    for (j = 0; j < n; ++j) printf "f 1 %d %d\n", 2+j, 2+(j+1)%n
    for (i = 0; i < m-2; ++i) for (j = 0; j < n; ++j) {
      a = 2+i*n+j; b = 2+i*n+(j+1)%n
      printf "f %d %d %d %d\n", a, a+n, b+n, b
    }
    last = 2+(m-1)*n
    for (j = 0; j < n; ++j) printf "f %d %d %d\n", last, 2+(m-2)*n+(j+1)%n, 2+(m-2)*n+j
  }'
}

# album NAME...: draws the album of an example of numbers; each NAME.png has to be there, a picture and small, and no other. Without a display, or built
# without VTK, the numbers alone are checked, and finish says so. Then arguments that it does not take. Leaves what it printed in drawn.out.
album() {
  run drawn 0 pictures/here
  if grep -q 'no pictures' drawn.err; then
    undrawn drawn.err
  else
    for name; do
      file=pictures/here/$name.png
      [ "$(head -c 4 "$file" | tail -c 3)" = PNG ] || fail "$file is no picture"
      [ "$(wc -c <"$file")" -lt 102400 ] || fail "$file is larger than 100 kB"
    done
    [ "$(find pictures -type f | wc -l)" -eq $# ] || fail "not $# pictures: $(ls pictures/here)"
  fi
  run no_folder 2 --what
  run two_folders 2 one two
}
