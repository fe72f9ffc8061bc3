#!/bin/sh
# SPDX-License-Identifier: MIT
# Plays all sides of the haptic hierarchy on this machine: a server with the tissue, a client with a hand that presses it, and one who looks on and draws.
#   sh play.sh FOLDER_OF_THE_PROGRAMS [SECONDS] [OUT_FOLDER]
set -eu
programs=${1:?where palpate-server, palpate-client and palpate-onlooker are}
seconds=${2:-6}
out=${3:-network-out}
mkdir -p "$out"
"$programs/palpate-server" >"$out/server.txt" 2>&1 &
server=$!
trap 'kill -TERM "$server" 2>/dev/null || true' EXIT
port=
for _ in $(seq 100); do
  port=$(sed -n 's/^palpate-server: listens on .*:\([0-9]*\)$/\1/p' "$out/server.txt")
  [ -z "$port" ] || break
  sleep 0.1
done
[ -n "$port" ] || { cat "$out/server.txt" >&2; exit 1; }
"$programs/palpate-onlooker" --port "$port" --seconds "$seconds" --out "$out/tissue.png" &
onlooker=$!
"$programs/palpate-client" --port "$port" --seconds "$seconds" --out "$out/session.csv"
wait "$onlooker"
kill -TERM "$server"
wait "$server"
trap - EXIT
tail -n 1 "$out/server.txt"
echo "the session, tick by tick: $out/session.csv; what was seen: $out/tissue.png, and touched: $out/tissue-touched.png"
