# SPDX-License-Identifier: MIT
# What the checks of the examples share. Each begins with: program=$1; . "${0%/*}/../../check.sh"
# They then work in a folder that is removed at the end, and exit with $failed.
set -u
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
failed=0

fail() {
  echo "FAILED: $*"
  failed=1
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
