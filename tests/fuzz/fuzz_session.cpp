// SPDX-License-Identifier: MIT
// Any bytes as a session: an error in one line, or a session that both formats keep to the last bit. A first byte of 128 and more: the lines of a text; below: what
// the frame of the binary form holds, whose length and checksum are made right, since no fuzzer guesses them.
#include <palpate/core/error.hpp>
#include <palpate/training/session_io.hpp>

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

namespace {

using namespace palpate;

void require(bool good) {
  if (!good) std::abort();
}

/// A place for texts, which are read from files alone; in memory where the machine has such a place.
std::filesystem::path const& text_file() {
  static std::filesystem::path const path = [] {
    std::filesystem::path const memory = "/dev/shm";
    auto const folder = std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
    return folder / ("fuzz_session_" + std::to_string(::getpid()) + ".csv");
  }();
  return path;
}

Session from_text(std::string_view text) {
  std::ofstream(text_file(), std::ios::binary | std::ios::trunc).write(text.data(), static_cast<std::streamsize>(text.size()));
  return read_session_csv(text_file());
}

std::string framed(std::string_view payload) {
  detail::ByteWriter out;
  out.raw(detail::session_magic);
  out.put(detail::session_format);
  out.put(static_cast<std::uint64_t>(payload.size()));
  out.raw(payload);
  out.put(detail::crc32(out.bytes()));
  return out.bytes();
}

std::optional<Session> read(std::uint8_t kind, std::string_view bytes) {
  try {
    return kind >= 128 ? from_text(bytes) : session_from_bytes(framed(bytes));
  } catch (FileError const& error) {
    require(std::string_view(error.what()).find('\n') == std::string_view::npos);
    return std::nullopt;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  if (size == 0) return 0;
  auto const session = read(data[0], {reinterpret_cast<char const*>(data + 1), size - 1});
  if (!session) return 0;
  std::string const bytes = to_bytes(*session), text = to_csv(*session);
  Session const of_bytes = session_from_bytes(bytes), of_text = from_text(text);
  require(to_bytes(of_bytes) == bytes && to_csv(of_bytes) == text);
  require(to_csv(of_text) == text);
  // Only the bytes keep the orientation and the gripper of a device that reports none, and that nobody knows a number that it has to state.
  auto const& device = session->device;
  bool const keeps_hand = session->hand.empty() || (device.reports_orientation && device.reports_gripper);
  if (keeps_hand && device.max_force.known() && device.rate.known() && (!(device.max_torque > 0) || device.max_torque.known())) require(to_bytes(of_text) == bytes);
  return 0;
}
