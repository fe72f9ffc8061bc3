#!/bin/sh
# SPDX-License-Identifier: MIT
# bench_step, or another with BENCH=its name, with the flags that users compile with: plain -O2, -O3, AVX2, and this processor.
#
#   sh benchmarks/step.sh [options of Google Benchmark]     CXX=g++ if not said; BENCH=solid for bench_solid
set -eu
cd "$(dirname "$0")/.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
for flags in '-O2' '-O3' '-O2 -march=x86-64-v3' '-O3 -march=native'; do
  # shellcheck disable=SC2086
  "${CXX-g++}" -std=c++20 -DNDEBUG $flags -Iinclude -Ibenchmarks -isystem "${EIGEN-/usr/include/eigen3}" "benchmarks/bench_${BENCH-step}.cpp" -o "$scratch/bench" \
    -lbenchmark_main -lbenchmark -lpthread
  printf '\n%s\n' "$flags"
  "$scratch/bench" "$@" 2>/dev/null
done
