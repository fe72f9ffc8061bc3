#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs the example and checks what is written, said and returned: guidance lowers the deviation and raises the score.
#   sh check_training.sh path/to/training
program=$1
. "${0%/*}/../../check.sh"

# value WHO NAME: the number behind a name in the lines of one person
value() {
  awk -v who="$1" -v name="$2" '$1 == who { for (i = 2; i < NF; ++i) if ($i == name) { sub(":", "", $(i + 1)); print $(i + 1); exit } }' out
}

# less A B
less() {
  awk -v a="$1" -v b="$2" 'BEGIN { exit !(a != "" && b != "" && a + 0 < b + 0) }'
}

"$program" >refused.out 2>refused.err
[ $? -eq 2 ] && grep -q "usage:" refused.err || fail "without a folder: $(cat refused.err)"
"$program" one two >refused.out 2>refused.err
[ $? -eq 2 ] && grep -q '"two" is one argument more' refused.err && [ ! -e one ] || fail "with two folders: $(cat refused.err)"
: >file
"$program" file >refused.out 2>refused.err
[ $? -eq 2 ] && grep -q "choose another" refused.err || fail "a file as folder: $(cat refused.err)"

"$program" first >out 2>err
code=$?
cat out
if [ "$code" -eq 2 ] && grep -q 'no pictures can be drawn' err; then
  undrawn err
  finish
fi
[ "$code" -eq 0 ] || fail "exit code $code: $(cat err)"
grep -q "the same bytes" out || fail "the replay differs"
less "$(value guided mean)" "$(awk -v m="$(value novice mean)" 'BEGIN { print 0.6 * m }')" || fail "guidance does not lower the deviation to 60 %"
less "$(value guided missed)" "$(value novice missed)" || fail "guidance does not lower what is missed"
less "$(awk -v s="$(value novice score)" 'BEGIN { print s + 3 }')" "$(value guided score)" || fail "guidance does not raise the score by 3 points"
for name in path deviation force; do
  [ -s "first/$name.png" ] || fail "there is no $name.png"
done
[ "$(find first -type f | wc -l)" -eq 9 ] || fail "not nine files: $(ls first)"
head -n 1 first/novice.csv | grep -q '^# palpate session 1$' || fail "novice.csv: $(head -n 1 first/novice.csv)"

"$program" second >out2 2>&1 || fail "the second run failed"
cmp -s out out2 || fail "two runs say different things"
for name in expert novice guided; do
  cmp -s "first/$name.session" "second/$name.session" || fail "$name.session differs between two runs"
done
[ "$failed" -eq 0 ] && echo "all good"
exit "$failed"
