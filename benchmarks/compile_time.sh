#!/bin/sh
# SPDX-License-Identifier: MIT
# What users pay in compile time: user time of the compiler beside a file that includes <Eigen/Dense> alone.
#
#   sh benchmarks/compile_time.sh [compiler] [flags]     g++ -O2 if not said; RUNS=5 runs, the least counts
#
# The least of several runs is what other programs on the machine disturb least.
set -eu
cd "$(dirname "$0")/.."
compiler=${1-g++}
[ $# -eq 0 ] || shift
flags=${*:--O2}
runs=${RUNS-5}
eigen=${EIGEN-/usr/include/eigen3}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# seconds <source>: the least user time of the runs.
seconds() {
  least=
  k=0
  while [ $k -lt "$runs" ]; do
    # shellcheck disable=SC2086
    taken=$( { command time -f %U "$compiler" -std=c++20 $flags -Iinclude -isystem "$eigen" -c "$1" -o "$scratch/out.o"; } 2>&1 | tail -n 1)
    least=$(printf '%s %s\n' "$taken" "${least:-$taken}" | awk '{ print $1 < $2 ? $1 : $2 }')
    k=$((k + 1))
  done
  printf '%s' "$least"
}

echo '#include <Eigen/Dense>' >"$scratch/eigen.cpp"
for name in palpate fitting training organs; do echo "#include <palpate/$name.hpp>" >"$scratch/$name.cpp"; done

one=$(seconds "$scratch/eigen.cpp")
printf '%-24s %8s %8s   (%s %s, least of %s)\n' file 'user s' 'ratio' "$compiler" "$flags" "$runs"
row() {
  t=$(seconds "$2")
  printf '%-24s %8s %8s\n' "$1" "$t" "$(awk -v t="$t" -v one="$one" 'BEGIN { printf "%.1f", t / one }')"
}
printf '%-24s %8s %8s\n' '<Eigen/Dense>' "$one" 1.0
for name in palpate fitting training organs; do row "<palpate/$name.hpp>" "$scratch/$name.cpp"; done
for program in examples/golden/0*.cpp; do row "$(basename "$program" .cpp)" "$program"; done
