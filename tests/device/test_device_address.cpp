// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"

#include <palpate/core/random.hpp>
#include <palpate/device/device_address.hpp>

#include <cstdint>
#include <exception>
#include <limits>
#include <string>
#include <string_view>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

std::string refusal_of(std::string_view text) {
  return message_of([&] { parse_device_address(text); });
}

}  // namespace

TEST_CASE("addresses are read into their parts", "[device]") {
  DeviceAddress const touch = parse_device_address("sim:touch?hand=light&seed=7");
  CHECK(touch.scheme == "sim");
  CHECK(touch.path == "touch");
  CHECK(touch.options.size() == 2);
  CHECK(touch.text("hand", "") == "light");
  CHECK(touch.count("seed", 0) == 7);
  CHECK(parse_device_address("null:").path.empty());
  CHECK(parse_device_address("HD:Default Device").scheme == "hd");
  CHECK(parse_device_address("hd:Default Device").path == "Default Device");
  CHECK(parse_device_address("haply://localhost:10001").path == "//localhost:10001");
  CHECK(parse_device_address("script:C:/a/b.csv").path == "C:/a/b.csv");
  CHECK(parse_device_address("script:why%3F%25%26.csv?path=a%26b=c").path == "why?%&.csv");
  CHECK(parse_device_address("script:x?path=a%26b=c").text("path", "") == "a&b=c");
  CHECK(parse_device_address("script:\xc3\xa4.csv").path == "\xc3\xa4.csv");
  CHECK(parse_device_address("script:x?").options.empty());
  CHECK(parse_device_address("script:x?empty=").text("empty", "other").empty());
}

TEST_CASE("text that is no address is refused with advice", "[device]") {
  CHECK(unsaid(refusal_of("touch"), "\"touch\"", "no colon", "sim:touch?hand=light") == "");
  CHECK(unsaid(refusal_of(""), "no colon") == "");
  CHECK(unsaid(refusal_of(":x"), "no scheme of two letters") == "");
  CHECK(unsaid(refusal_of("C:/strokes.csv"), "two letters or more", "script:C:/strokes.csv") == "");
  CHECK(unsaid(refusal_of("9x:y"), "scheme that is no name") == "");
  CHECK(unsaid(refusal_of("a b:y"), "scheme that is no name") == "");
  CHECK(unsaid(refusal_of("sim:x?hand"), "\"hand\" without name or value") == "");
  CHECK(unsaid(refusal_of("sim:x?=light"), "without name or value") == "");
  CHECK(unsaid(refusal_of("sim:x?Hand=light"), "\"Hand\"", "small letters") == "");
  CHECK(unsaid(refusal_of("sim:x?a=1&a=2"), "the option a twice") == "");
  CHECK(unsaid(refusal_of("sim:x?a=1&&b=2"), "without name or value") == "");
  CHECK(unsaid(refusal_of("sim:x?a=1&"), "ends with &") == "");
  CHECK(unsaid(refusal_of("sim:50%.csv"), "% without two hexadecimal digits", "%25") == "");
  CHECK(unsaid(refusal_of("sim:50%4"), "%25") == "");
  CHECK(unsaid(refusal_of("sim:a\nb"), "control character, byte 10") == "");
  CHECK(unsaid(refusal_of("sim:a%00b"), "control character, byte 0") == "");
  CHECK(refusal_of(std::string(100000, 'x')).size() < 500);
}

TEST_CASE("options are numbers, words and points", "[device]") {
  DeviceAddress const address = parse_device_address(
      "sim:x?a=1.5&b=-2e-3&c=12&d=firm&e=0.1,-0.2, 3&f=nan&g=1,2&h=1,2,3,4&i=-1&j=99999999999999999999&k=1.5x");
  CHECK(address.number("a", 0) == 1.5);
  CHECK(address.number("b", 0) == -2e-3);
  CHECK(address.number("nothing", 4.5) == 4.5);
  CHECK(address.count("c", 0) == 12);
  CHECK(address.choice("d", {"light", "normal", "firm"}) == 2);
  CHECK(address.choice("nothing", {"light", "normal"}) == 0);
  CHECK(address.point("e", Vector3<double>::Zero()) == Vector3<double>(0.1, -0.2, 3));
  CHECK(address.point("nothing", {1, 2, 3}) == Vector3<double>(1, 2, 3));
  CHECK(unsaid(message_of([&] { address.number("f", 0); }), "f=nan of sim:x", "give a number") == "");
  CHECK(unsaid(message_of([&] { address.number("k", 0); }), "k=1.5x") == "");
  CHECK(unsaid(message_of([&] { address.count("i", 0); }), "i=-1", "whole number") == "");
  CHECK(unsaid(message_of([&] { address.count("j", 0); }), "whole number") == "");
  CHECK(unsaid(message_of([&] { address.choice("d", {"light", "normal"}); }), "d=firm", "light, normal") == "");
  CHECK(unsaid(message_of([&] { address.point("g", {0, 0, 0}); }), "g=1,2", "x,y,z") == "");
  CHECK(unsaid(message_of([&] { address.point("h", {0, 0, 0}); }), "h=1,2,3,4", "x,y,z") == "");
}

TEST_CASE("whatever the bytes, an address is refused or comes back from its own text", "[device]") {
  // Laws: no exception but InvalidArgument; parse(to_string(a)) = a; the text of a has no byte that ends it.
  Random random(Seed{21});
  std::string_view const likely = "sim:touch?hand=light&seed=7%25%3F:/,.-_ABC09\n\x80";
  int taken = 0;
  for (int k = 0; k < 60000; ++k) {
    std::string text = k % 3 == 0 ? "" : k % 3 == 1 ? "sim:touch?a=b&" : "script:";
    for (std::uint64_t length = random.below(24); length > 0; --length)
      text += random.below(8) == 0 ? static_cast<char>(random.below(256)) : likely[static_cast<std::size_t>(random.below(likely.size()))];
    try {
      DeviceAddress const address = parse_device_address(text);
      ++taken;
      std::string const again = to_string(address);
      REQUIRE(parse_device_address(again) == address);
      REQUIRE(to_string(parse_device_address(again)) == again);
      for (auto const& [option, value] : address.options) REQUIRE_FALSE(option.empty());
    } catch (InvalidArgument const& refused) {
      REQUIRE(std::string_view(refused.what()).find("device address") == 0);
    }
  }
  CHECK(taken > 5000);
}
