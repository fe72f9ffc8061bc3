// SPDX-License-Identifier: MIT
// Strokes out of any bytes over a small body, everything checked after every tick: what no cut may change, and what the sanitizers see.
// A case that fails is printed as a test case; libFuzzer keeps its bytes.
//
//   cmake --preset fuzz && cmake --build --preset fuzz && build/fuzz/tests/fuzz/fuzz_strokes -max_len=300 -max_total_time=600
#include "cutting/shrink_stroke.hpp"
#include "cutting/stroke_bytes.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  auto const check = [](auto const& strokes) {
    auto const found = violations_of(strokes);
    if (found.empty()) return;
    auto const smallest = shrunk(strokes, [](auto const& c) { return violations_of(c) != ""; });
    std::fputs(to_test_case(smallest, violations_of(smallest)).c_str(), stderr);
    std::abort();
  };
  if (size < 3) return 0;
  if (data[2] % 16 == 8)
    check(strokes_from_bytes<float>({data, size}));
  else
    check(strokes_from_bytes<double>({data, size}));
  return 0;
}
