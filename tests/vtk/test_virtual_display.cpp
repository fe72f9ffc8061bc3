// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "skip.hpp"

#include <palpate/vtk/virtual_display.hpp>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

using namespace palpate;

namespace {

/// Sets DISPLAY as long as it lives.
class DisplaySet {
 public:
  explicit DisplaySet(std::string const& display) {
    if (char const* const found = std::getenv("DISPLAY")) before_ = found;
    setenv("DISPLAY", display.c_str(), 1);
  }
  ~DisplaySet() {
    if (before_.empty())
      unsetenv("DISPLAY");
    else
      setenv("DISPLAY", before_.c_str(), 1);
  }

 private:
  std::string before_;
};

}  // namespace

// Yardstick: Xvfb, which -terminate ends as soon as nothing is connected any more.
TEST_CASE("a display that is there already stays as long as it is wanted", "[vtk][display]") {
  auto const close = [](std::FILE* stream) { pclose(stream); };   // waits for the server's end
  std::unique_ptr<std::FILE, decltype(close)> const server(popen("exec Xvfb -displayfd 1 -terminate -nolisten tcp 2>/dev/null", "r"), close);
  REQUIRE(server != nullptr);
  std::array<char, 16> number{};
  if (std::fgets(number.data(), number.size(), server.get()) == nullptr) PALPATE_SKIP("Xvfb did not start; install it (Debian: apt-get install xvfb)");
  DisplaySet const set(":" + std::string(number.data(), std::string(number.data()).find('\n')));
  {
    VirtualDisplay const display;
    REQUIRE(display.ready());
    for (int k = 0; k < 5; ++k) CHECK(display_available());   // each a connection that closes again
  }
  while (std::fgetc(server.get()) != EOF) {
  }
  CHECK_FALSE(display_available());
}
