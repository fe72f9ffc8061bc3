// SPDX-License-Identifier: MIT
// Device addresses out of any bytes: refused with `InvalidArgument`, or back from their own text.
//
//   build/fuzz/tests/fuzz/fuzz_device_address -max_len=200 -max_total_time=60
#include <palpate/device/device_address.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  palpate::DeviceAddress address;
  try {
    address = palpate::parse_device_address({reinterpret_cast<char const*>(data), size});
  } catch (palpate::InvalidArgument const&) {
    return 0;
  }
  if (!(palpate::parse_device_address(palpate::to_string(address)) == address)) std::abort();   // what it throws here ends the run too
  return 0;
}
