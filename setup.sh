#!/bin/sh
# SPDX-License-Identifier: MIT
#
#   sh setup.sh demo [options of incision]   install what is missing, configure, build, run the main job
#   sh setup.sh test                         the same for all tests
#   sh setup.sh test --long                  the soak, fuzz and long property runs, some hours; a summary line for each
#
# On Debian 12 missing packages are installed with apt, as root or through sudo. On another system nothing is installed:
# what is needed is listed. Both commands can be repeated; what is there is left alone.
set -eu

# Debian package, then what another system has to provide.
demo_needs='
g++               a C++20 compiler: gcc 12 or newer, clang 14 or newer
cmake             CMake 3.24 or newer
ninja-build       Ninja
libeigen3-dev     Eigen 3.4
libvtk9-dev       VTK 9 with charts and OpenGL rendering
libcli11-dev      CLI11 2
xvfb              Xvfb, where there is no display
xauth             xauth, with Xvfb
'
test_needs="$demo_needs"'
catch2            Catch2 2.13 or 3
libbenchmark-dev  Google Benchmark 1.7 or newer
libfcl-dev        FCL 0.7
libccd-dev        libccd 2
libtbb-dev        oneTBB
nlohmann-json3-dev  nlohmann-json 3.10
libboost-dev      Boost 1.74 with Asio and Beast
libbullet-dev     Bullet 3, a peer in the benchmarks
clang-16          clang 16 as clang++-16
libclang-rt-16-dev  the sanitizers of clang 16
llvm-16           llvm-symbolizer-16, which names functions in their reports
ccache            ccache
'

say() { printf 'setup.sh: %s\n' "$*"; }

usage() {
  sed -n 's/^#   sh/sh/p' "$0"
  exit 2
}

packages_of() { printf '%s\n' "$1" | sed -n 's/^\([^ ]\{1,\}\) .*/\1/p'; }

on_debian_12() (
  [ -r /etc/os-release ] || exit 1
  # shellcheck disable=SC1091
  . /etc/os-release
  [ "${ID-}" = debian ] && [ "${VERSION_ID-}" = 12 ] && command -v apt-get >/dev/null
)

list_needs() {
  say "this needs (Debian 12 package: what it is):"
  printf '%s\n' "$1" | sed -n 's/^\([^ ]\{1,\}\) \{1,\}\(.*\)/  \1: \2/p'
}

# install_debian <packages>: prints each package that apt sets up, or that nothing was missing.
install_debian() {
  missing=
  for package in $1; do
    status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) || status=
    [ "$status" = installed ] || missing="$missing $package"
  done
  if [ -z "$missing" ]; then
    say "already installed"
    return
  fi
  as_root=
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      say "not root and no sudo; run as root:"
      printf '  apt-get update && apt-get install --no-install-recommends%s\n' "$missing"
      exit 1
    fi
    as_root=sudo
  fi
  say "installing$missing"
  scratch=$(mktemp -d)
  $as_root apt-get update -qq
  {
    $as_root env DEBIAN_FRONTEND=noninteractive \
      apt-get install -y -q --no-install-recommends -o Dpkg::Use-Pty=0 $missing 2>&1 && touch "$scratch/done"
  } | tee "$scratch/log" | sed -n -u 's/^Setting up \(.*\) \.\.\.$/  installed \1/p'
  if [ ! -e "$scratch/done" ]; then
    tail -n 30 "$scratch/log"
    rm -rf "$scratch"
    say "apt could not install the packages; its last messages are above"
    exit 1
  fi
  rm -rf "$scratch"
}

# provide <needs>: installs on Debian 12, elsewhere stops when even the tools to configure with are not there.
provide() {
  needs=$1
  if on_debian_12; then
    install_debian "$(packages_of "$needs")"
  elif ! command -v cmake >/dev/null || ! command -v ninja >/dev/null || ! command -v c++ >/dev/null; then
    say "this is not Debian 12: nothing is installed here"
    list_needs "$needs"
    exit 1
  else
    say "this is not Debian 12: nothing is installed here, trying with what is there"
  fi
}

started=$(date +%s)
step() { printf '\nsetup.sh: [%d s] %s\n' "$(($(date +%s) - started))" "$*"; }

# configure <preset> [options]: says once more what is needed when CMake does not find it.
configure() {
  cmake --preset "$@" --log-level=NOTICE >/dev/null || {
    say "CMake did not find what it needs; its message is above"
    list_needs "$needs"
    exit 1
  }
}

# Pictures are drawn off screen, yet VTK asks for a display; one that stays when its last window closes.
with_display() {
  if [ -n "${DISPLAY-}" ] || ! command -v xvfb-run >/dev/null; then
    "$@"
  else
    xvfb-run -a -s '-screen 0 1280x1024x24 -noreset' "$@"
  fi
}

# The thread sanitizer of clang 16 stops where the kernel spreads addresses too widely.
with_plain_addresses() {
  if setarch "$(uname -m)" -R true 2>/dev/null; then
    setarch "$(uname -m)" -R "$@"
  else
    "$@"
  fi
}

# Of the sanitizers.
name_functions_in_reports() {
  if command -v llvm-symbolizer-16 >/dev/null; then
    ASAN_SYMBOLIZER_PATH=$(command -v llvm-symbolizer-16)
    TSAN_SYMBOLIZER_PATH=$ASAN_SYMBOLIZER_PATH
    export ASAN_SYMBOLIZER_PATH TSAN_SYMBOLIZER_PATH
  fi
}

jobs=$(nproc 2>/dev/null || getconf _NPROCESSORS_ONLN)

demo() {
  provide "$demo_needs"
  step "configure (preset release)"
  configure release -D PALPATE_COMPONENTS=vtk
  step "build examples/incision"
  cmake --build build/release --target incision --parallel "$jobs" || {
    say "examples/incision was not built; the messages are above"
    list_needs "$needs"
    exit 1
  }
  step "run it"
  with_display build/release/examples/incision/incision "$@"
  out=incision-out   # or what --out says
  while [ $# -gt 0 ]; do
    case $1 in
      --out) [ $# -lt 2 ] || out=$2 ;;
      --out=*) out=${1#--out=} ;;
    esac
    shift
  done
  case $out in
    /*) ;;
    *) out=$(pwd)/$out ;;
  esac
  fake=build/release/fake_libhd/libHD.so
  [ ! -e "$fake" ] || say "with a PHANToM or Touch: sh setup.sh demo --device hd:   without one: PALPATE_LIBHD=\$PWD/$fake sh setup.sh demo --device hd:"
  step "done; the output is in $out"
}

run_tests() {
  provide "$test_needs"

  step "gcc, warnings are errors: what hosts see, tests for them"
  configure ci -D CMAKE_CXX_COMPILER=g++
  cmake --build --preset ci --parallel "$jobs"
  step "gcc: run the tests"
  with_display ctest --preset ci --parallel "$jobs"

  step "clang 16, warnings are errors: all headers, tests, examples"
  configure plain -D CMAKE_CXX_COMPILER=clang++-16
  cmake --build --preset plain --parallel "$jobs"
  step "clang 16: run the tests"
  with_display ctest --preset plain --parallel "$jobs"

  name_functions_in_reports
  step "clang 16, warnings are errors, address and undefined-behaviour sanitizers"
  configure asan -D CMAKE_CXX_COMPILER=clang++-16
  cmake --build --preset asan --parallel "$jobs"
  step "clang 16, sanitizers: run the tests"
  with_display ctest --preset asan --parallel "$jobs"

  step "clang 16, thread sanitizer: what has threads"
  configure tsan -D CMAKE_CXX_COMPILER=clang++-16
  cmake --build --preset tsan --parallel "$jobs"
  with_plain_addresses ctest --preset tsan --parallel "$jobs"

  step "all tests passed"
}

# part <name> <command>...: one run of those that take long. It is timed, its output kept, and the others follow whatever becomes of it.
part() {
  name=$1
  shift
  log=build/long/$(printf '%s' "$name" | tr -c 'a-z0-9\n' _).log
  step "$name"
  begun=$(date +%s)
  if "$@" >"$log" 2>&1 && ! grep -q 'No tests ran' "$log"; then   # Catch 2 calls that a success
    result="passed  "
  else
    result="FAILED  "
    failed=1
    tail -n 20 "$log"
  fi
  printf '%s %6d s  %s\n' "$result" "$(($(date +%s) - begun))" "$name" | tee -a build/long/summary
}

# as_often_as_always <command>...: with the numbers of `setup.sh test`, not with those of the long runs.
as_often_as_always() (
  unset PALPATE_SOAK_SESSIONS PALPATE_SOAK_TICKS PALPATE_STROKES PALPATE_ORGANS PALPATE_SOLID_STEPS PALPATE_SOLID_BEAM_STEPS PALPATE_TETRA_EDITS PALPATE_SOLID_RANDOM PALPATE_SOLID_STROKES \
    PALPATE_CROSSINGS PALPATE_BENDS PALPATE_SKIN_STROKES PALPATE_ASPIRATIONS PALPATE_POSES PALPATE_CONTACT_STARTS PALPATE_COLLISIONS \
    PALPATE_SCENE_TICKS PALPATE_GMSH_FILES PALPATE_VTK_FILES PALPATE_EXCHANGES
  "$@"
)

# Each number can be set in the environment, to small ones for a trial.
run_long_tests() {
  : "${PALPATE_SOAK_SESSIONS:=100}" "${PALPATE_SOAK_TICKS:=100000}" "${PALPATE_STROKES:=100000}" "${PALPATE_ORGANS:=20}" \
    "${PALPATE_SOLID_STEPS:=100000}" "${PALPATE_SOLID_BEAM_STEPS:=1000}" "${PALPATE_TETRA_EDITS:=100000}" "${PALPATE_SOLID_RANDOM:=10000}" "${PALPATE_SOLID_STROKES:=10000}" "${PALPATE_CROSSINGS:=2000}" \
    "${PALPATE_BENDS:=200}" "${PALPATE_SKIN_STROKES:=10000}" "${PALPATE_ASPIRATIONS:=1000}" \
    "${PALPATE_POSES:=10000}" "${PALPATE_CONTACT_STARTS:=10000}" "${PALPATE_COLLISIONS:=10000}" "${PALPATE_SCENE_TICKS:=60000}" "${PALPATE_GMSH_FILES:=100000}" "${PALPATE_VTK_FILES:=100000}" "${PALPATE_EXCHANGES:=100000000}" "${PALPATE_FUZZ_SECONDS:=600}"
  export PALPATE_SOAK_SESSIONS PALPATE_SOAK_TICKS PALPATE_STROKES PALPATE_ORGANS PALPATE_SOLID_STEPS PALPATE_SOLID_BEAM_STEPS PALPATE_TETRA_EDITS PALPATE_SOLID_RANDOM PALPATE_SOLID_STROKES \
    PALPATE_CROSSINGS PALPATE_BENDS PALPATE_SKIN_STROKES PALPATE_ASPIRATIONS PALPATE_POSES PALPATE_CONTACT_STARTS PALPATE_COLLISIONS PALPATE_SCENE_TICKS PALPATE_GMSH_FILES PALPATE_VTK_FILES PALPATE_EXCHANGES
  provide "$test_needs"
  mkdir -p build/long
  : >build/long/summary
  failed=0

  step "gcc: every test, example and benchmark, and what runs for long"
  configure ci -D CMAKE_CXX_COMPILER=g++ -D PALPATE_TEST_PASS= -D PALPATE_EXAMPLES= -D PALPATE_BUILD_BENCHMARKS=ON -D PALPATE_PRECOMPILE=ON
  cmake --build --preset ci --parallel "$jobs"
  part "every test and example in double, gcc" as_often_as_always with_display ctest --preset ci --parallel "$jobs" --tests-regex '^(test|example)_|_(precision|training)$'
  part "every mistake, as either compiler tells it" ctest --preset ci --parallel "$jobs" --tests-regex '^compile_fail[.]'
  part "$PALPATE_SOAK_SESSIONS sessions of a hand, $PALPATE_SOAK_TICKS ticks each" build/ci/tests/test_cutting_simulator_device '[soak]'
  part "$PALPATE_STROKES random strokes" build/ci/tests/test_cutting_simulator_device 'random strokes across each other*'
  part "$PALPATE_SOLID_STROKES random strokes through solids" build/ci/tests/test_cutting_simulator_device 'whatever is cut*'
  part "$PALPATE_CROSSINGS pairs of cuts that cross in solids" build/ci/tests/test_cutting_simulator_device 'two planes that cross leave*,cuts that cross in tissue*'
  part "three times $PALPATE_BENDS blades that bend, in 10, 100 and 1000 ticks" build/ci/tests/test_cutting_simulator_device '*blade that bends is the same*'
  part "$PALPATE_ASPIRATIONS solids of which tissue is taken away" build/ci/tests/test_cutting_simulator_device 'whatever is taken away*'
  part "$PALPATE_ORGANS organs, 200 strokes each" build/ci/tests/test_cutting_simulator_device 'strokes across each other leave*'
  part "$PALPATE_ORGANS times five uneven meshes, 40 strokes each" build/ci/tests/test_cutting_simulator_device 'strokes over uneven meshes*'
  part "a solid over $PALPATE_SOLID_STEPS steps" build/ci/tests/test_tissue_material_mesh_region 'an undamped solid keeps its energy and momenta*'
  part "beams that are let go over $PALPATE_SOLID_BEAM_STEPS steps of 10 ms" build/ci/tests/test_tissue_material_mesh_region 'a beam that is let go*'
  part "$PALPATE_TETRA_EDITS random edits of tetrahedra" build/ci/tests/test_tissue_material_mesh_region 'random edits of solids*'
  part "$PALPATE_SOLID_RANDOM random solids" build/ci/tests/test_tissue_material_mesh_region 'random solids under random forces*'
  part "$PALPATE_SKIN_STROKES random strokes through skins" build/ci/tests/test_volume 'no triangle of a skin spans a wound*'
  part "$PALPATE_POSES random poses of four tools at three bodies" build/ci/tests/test_tool 'Whatever four tools do at random*'
  part "$PALPATE_CONTACT_STARTS starts of two solids in one another" build/ci/tests/test_contact 'two solids that begin deep*'
  part "$PALPATE_COLLISIONS collisions of two solids" build/ci/tests/test_contact 'bodies that collide*'
  part "two solids on a table for $PALPATE_SCENE_TICKS ms" build/ci/tests/test_scene 'bodies on one another bear*'
  part "two solids of 3,840 tetrahedra with four tools allocate nothing" build/ci/tests/test_scene '*four tools allocate nothing'
  part "every cell of a network's delays, jitters and losses" env PALPATE_NETWORK_GRID=1 build/ci/tests/test_network 'C5-N1: in every cell*'
  part "$PALPATE_GMSH_FILES damaged Gmsh files" build/ci/tests/test_volume 'damaged Gmsh files*'
  part "$PALPATE_VTK_FILES damaged VTK volumes" build/ci/tests/test_vtk 'a damaged volume*'
  part "$PALPATE_VTK_FILES damaged surfaces" build/ci/tests/test_vtk 'a damaged surface*'

  step "clang 16, address sanitizer and every check of the undefined-behaviour sanitizer"
  name_functions_in_reports
  configure sanitized -D CMAKE_CXX_COMPILER=clang++-16
  cmake --build --preset sanitized --parallel "$jobs"
  part "every test in float and double" as_often_as_always with_display ctest --preset sanitized --parallel "$jobs"
  part "$PALPATE_SOLID_STROKES random strokes through solids, in float" build/sanitized/tests/test_cutting_simulator_device '*- float[volume_cutter][random]'

  step "clang 16, thread sanitizer"
  configure tsan -D CMAKE_CXX_COMPILER=clang++-16
  cmake --build --preset tsan --parallel "$jobs" --target test_core test_simulator
  part "$PALPATE_EXCHANGES exchanges between threads: buffers" with_plain_addresses build/tsan/tests/test_core '[exchanges]'
  part "$PALPATE_EXCHANGES exchanges between threads: snapshots" with_plain_addresses build/tsan/tests/test_simulator '[exchanges]'

  step "clang 16, libFuzzer"
  configure fuzz -D CMAKE_CXX_COMPILER=clang++-16
  cmake --build --preset fuzz --parallel "$jobs"
  for source in tests/fuzz/*.cpp; do
    target=$(basename "$source" .cpp)
    mkdir -p "build/long/$target"
    part "$target for $PALPATE_FUZZ_SECONDS s" "build/fuzz/tests/fuzz/$target" -max_len=600 -len_control=0 -max_total_time="$PALPATE_FUZZ_SECONDS" \
      -artifact_prefix=build/long/ "build/long/$target"
  done

  step "summary"
  cat build/long/summary
  [ "$failed" -eq 0 ] || {
    say "a long run failed; its output is in build/long"
    exit 1
  }
}

cd "$(dirname "$0")"
case ${1-} in
  demo)
    shift
    demo "$@"
    ;;
  test)
    case $#-${2-} in
      1-) run_tests ;;
      2---long) run_long_tests ;;
      *) usage ;;
    esac
    ;;
  *) usage ;;
esac
