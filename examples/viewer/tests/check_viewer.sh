#!/bin/sh
# SPDX-License-Identifier: MIT
# Plays a scripted mouse in the viewer, compares its pictures with what the simulator says, and tries bad input.
#   sh check_viewer.sh path/to/viewer path/to/check_shots path/to/tests
program=$1
check_shots=$2
tests=$3
. "${0%/*}/../../check.sh"

# refused NAME TEXT ARGUMENTS...: exit code 2, one line with TEXT on standard error
refused() {
  text=$2
  name=$1
  shift 2
  run "$name" 2 "$@"
  [ "$(wc -l <"$name.err")" -eq 1 ] && grep -q -e "$text" "$name.err" || fail "$name: not one line with \"$text\": $(cat "$name.err")"
}

# by_the_clock NAME ARGUMENTS...: the script NAME.script in real time, in a small window, meanwhile; its process is $NAME
by_the_clock() {
  name=$1
  shift
  "$program" --script "$name.script" --realtime --width 960 --height 680 "$@" --out "$name" >"$name.out" 2>"$name.err" &
  eval "$name=$!"
}

# Each of two cuts, in one run until a key ends it, is remembered when the tool leaves it, and is taken back by itself.
printf 'move 263 357 0.4\nleft down\nwait 0.4\nwheel 6\nwait 0.5\nmove 331 349 0.8\nleft up\nwait 0.6\n' >cuts.script
printf 'move 161 374 0.5\nwait 0.3\nleft down\nwait 0.5\nmove 221 391 0.8\nleft up\nwait 0.6\nshot both\n' >>cuts.script
printf 'key u\nwait 0.5\nshot one\nkey u\nwait 0.5\nshot none\nkey u\nwait 0.5\nshot no_more\n' >>cuts.script
by_the_clock cuts --resolution 500

"$program" --script "$tests/stroke.script" --resolution 1200 --out first >first.out 2>first.err
code=$?
cat first.out
if [ "$code" -eq 2 ] && grep -q 'no X display' first.err; then
  wait
  undrawn first.err
  finish
fi
[ "$code" -eq 0 ] || fail "exit code $code: $(cat first.err)"
"$check_shots" first || fail "the pictures and the report differ"
[ -s first/recording_1.session ] || fail "there is no recording"

# A hand recorded from the first tick on, on an organ that is made anew by another process, gives the same bytes.
printf 'key r\nmove 380 420 0.2\nwait 0.3\nleft down\nwait 0.3\nwheel 6\nmove 460 410 0.6\nleft up\nwait 0.3\nkey r\nwait 0.1\n' >record.script
printf 'wait 3\nshot replayed\n' >replay.script
run record 0 --script record.script --resolution 500 --out record
run replay 0 --script replay.script --replay record/recording_1.session --resolution 600 --out replay
grep -q '^note replayed: the same bytes' replay/report.txt || fail "replay: $(grep '^note' replay/report.txt)"
grep -q '^uncut 0' replay/report.txt || fail "replay: nothing was cut"

# A hook beside a wound, in the second hand. Recorded, both hands give the same bytes in another process; without the hook's part they do not.
run hook 0 --script "$tests/hook.script" --resolution 500 --out hook
"$check_shots" hook unhooked hooked drawn cutting_on lifted || fail "hook: the pictures and the report differ"
printf 'wait 6.5\nshot replayed\n' >replay_hook.script
mkdir alone && cp hook/recording_1.session alone
"$program" --script replay_hook.script --replay alone/recording_1.session --out mouse >mouse.out 2>mouse.err &
mouse=$!
run both 0 --script replay_hook.script --replay hook/recording_1.session --out both
grep -q '^note replayed: the same bytes' both/report.txt || fail "hook: $(grep '^note' both/report.txt)"
refused hooks_part "give the mouse's" --script replay.script --replay hook/recording_1_hook.session
[ ! -e record/recording_1_hook.session ] || fail "hook: a file of a hook that was not used"
cp record/recording_1.session other.session && cp record/recording_1.session other_hook.session
refused others "is not the hook's part" --script replay.script --replay other.session
wait "$mouse" || fail "without the hook: exit code $?: $(cat mouse.err)"
[ "$(sed -n 's/^note //p' mouse/report.txt)" = replayed ] || fail "without the hook: $(grep '^note' mouse/report.txt)"

wait "$cuts" || fail "cuts: exit code $?: $(cat cuts.err)"
[ "$(sed -n 's/^uncut //p' cuts/report.txt | tr -d '\n')" = 0011 ] || fail "cuts taken back: $(grep -e '^uncut' -e '^note' cuts/report.txt)"

# A few moments with the other integrator and tissue, and by the clock, where pictures are drawn all the time.
printf 'key t\nkey i\nmove 263 357\nwait 0.4\nleft down\nwait 1\nshot firm\n' >pressed.script
by_the_clock pressed --resolution 500
printf 'move 263 357\nwait 0.3\nkey 2\nwait 3\nshot held\nkey t\nwait 0.5\nshot anew\n' >held.script
by_the_clock held --resolution 500
printf "wheel 1e9\n" >spin.script
refused spin "line 1 is .wheel 1e9" --script spin.script
printf 'key t\nkey i\nmove 380 420\nwait 0.4\nleft down\nwait 0.4\nshot firm\n' >firm.script
run firm 0 --script firm.script --resolution 500 --out firm
grep -q '^phase indenting' firm/report.txt || fail "firm: $(cat firm/report.txt)"

# A solid: palpated, felt, then cut; the cut is taken back, and the key for the cutter knows two.
printf 'move 300 430\nwait 0.3\nleft down\nwait 0.4\nshot solid\nwheel 6\nwait 0.3\nmove 400 421 0.6\nshot solid_cutting\nmove 500 412 0.6\nleft up\nwait 0.3\nshot solid_cut\n' >solid.script
printf 'key u\nwait 0.1\nshot solid_undone\nkey k\nwait 0.02\nshot blunt\nkey k\nwait 0.02\nshot sharp\n' >>solid.script
run solid 0 --script solid.script --tissue solid --coupling tight --resolution 500 --out solid
"$check_shots" solid solid solid_cut solid_undone || fail "solid: the pictures and the report differ"
awk '/^shot/ { name = $2 } /^phase indenting/ && name == "solid" { phase = 1 } /^force / && name == "solid" { felt = $4 > 0.1 } END { exit !(phase && felt) }' solid/report.txt || fail "solid: $(cat solid/report.txt)"
[ "$(sed -n 's/^note cutter: //p' solid/report.txt | tr '\n' ' ')" = "none, palpate only progressive " ] || fail "solid: $(grep '^note' solid/report.txt)"
# The edge reaches 26 mm into the tissue and is drawn 200 pixels, 47 mm: 12 cm2, less what does not open at the ends.
awk '/^shot/ { name = $2 } /^pieces/ { pieces[name] = $2 } /^cut_area/ { area[name] = 1e4 * $2 } END {
  exit !(pieces["solid_cut"] == 1 && area["solid"] == 0 && area["solid_undone"] == 0 && area["solid_cut"] > 8 && area["solid_cut"] < 13) }' solid/report.txt ||
  fail "solid: $(grep -e '^shot' -e '^pieces' -e '^cut_area' solid/report.txt)"

# The hand pays for the cut: 60 J/m2 times the 26 mm of the edge in tissue, and the same times the area.
awk '/^shot/ { name = $2 } /^phase/ { phase[name] = $2 } /^force / { force[name] = sqrt($2 * $2 + $3 * $3 + $4 * $4) } /^energy / { energy[name] = $2 }
  /^cut_area/ { area[name] = $2 } END { at = force["solid_cutting"]
  exit !(phase["solid_cutting"] == "moving" && at > 1.2 && at < 1.9 && energy["solid_cut"] >= 60 * area["solid_cut"]) }' solid/report.txt ||
  fail "solid: $(grep -e '^shot' -e '^phase' -e '^force ' -e '^energy ' -e '^cut_area' solid/report.txt)"

wait "$pressed" || fail "pressed: exit code $?: $(cat pressed.err)"
"$check_shots" pressed firm || fail "the picture in real time and the report differ"
grep -q '^drew .* pictures a second' pressed.out || fail "pressed: $(cat pressed.out)"
wait "$held" || fail "held: exit code $?: $(cat held.err)"
[ "$(sed -n 's/^hooked //p; s/^hook_parked //p' held/report.txt | tr -d '\n')" = 1001 ] && grep -q '^note tissue: firm; hook lifted away' held/report.txt ||
  fail "held: $(grep -e '^hook' -e '^note' held/report.txt)"

# An organ from a file, its upper side along y: pressed, cut, recorded; replayed from a copy at another place, with the same bytes.
ellipsoid | awk '$1 == "v" { print "v", $2, $4, -$3; next } { print }' >organ.obj
run organ 0 --script record.script --mesh organ.obj --unit cm --out organ
mkdir elsewhere && mv organ.obj elsewhere
refused moved "made on the mesh organ.obj, and there is no organ.obj; say with --mesh" --script replay.script --replay organ/recording_1.session --out moved
run again 0 --script replay.script --replay organ/recording_1.session --mesh elsewhere/organ.obj --out again
grep -q '^note replayed: the same bytes' again/report.txt || fail "organ: $(grep '^note' again/report.txt)"
grep -q '^uncut 0' again/report.txt || fail "organ: nothing was cut"
refused metres "in cm it would be 0.141 m.*--unit" --script replay.script --mesh elsewhere/organ.obj
refused thin "mm thick, and this tool cuts from 8 mm on" --script replay.script --mesh elsewhere/organ.obj --unit mm
head -c 900 elsewhere/organ.obj >short.obj
refused short "short.obj" --script replay.script --mesh short.obj
refused no_mesh "requires --mesh" --unit cm
# What was recorded in lock-step by another program, as text; and a file that is no recording.
printf 'time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J\n0,0,0,0.08,0,no contact,0,0,0,0\n0.001,0,0,0.08,0,no contact,0,0,0,0\n' >tips.csv
run tips 0 --script replay.script --replay tips.csv --resolution 500 --out tips
grep -q '^note replayed' tips/report.txt || fail "tips: $(grep '^note' tips/report.txt)"
cp tips.csv tips.session
refused no_session "not a session in binary form; give a file that was recorded" --replay tips.session

refused missing "does not exist" --script missing.script
printf 'move 10\n' >bad.script
refused bad "line 1" --script bad.script
refused no_recording "the file does not exist" --replay missing.session
refused option "resolution" --resolution 3
refused words "not expected: --bogus one two (see" --bogus one two
refused not_a_number "nan is not a number" --seconds nan
: >file
refused folder "choose another" --script replay.script --out file/below

[ "$failed" -eq 0 ] && echo "viewer: all checks passed"
exit "$failed"
