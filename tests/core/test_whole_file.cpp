// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "scratch_folder.hpp"

#include <palpate/core/detail/whole_file.hpp>

#include <cstddef>
#include <string>

using namespace palpate;

TEST_CASE("a file is read to its last byte, of any size", "[whole_file]") {
  ScratchFolder const folder;
  for (std::size_t const size : {0u, 1u, 16383u, 16384u, 16385u, 100000u}) {
    std::string bytes(size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * 7);
    CHECK(detail::read_whole_file(folder.write("a", bytes)) == bytes);
  }
}

#if defined(__linux__)
// Of a process's memory nothing is at address 0: it can be opened, and reading fails.
TEST_CASE("reading that stops with an error is a FileError", "[whole_file][error]") {
  try {
    (void)detail::read_whole_file("/proc/self/mem");
    FAIL("no error");
  } catch (FileError const& error) {
    CHECK(std::string(error.what()) == "/proc/self/mem: reading stopped with an error; check the disk or copy the file again");
  }
}
#endif
