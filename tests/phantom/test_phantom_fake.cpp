// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "phantom/fake.hpp"

#include <palpate/device/phantom.hpp>

#include <array>
#include <string>
#include <vector>

using palpate_test::advance_fake;
using palpate_test::fake_function;
using palpate_test::fresh_fake;

namespace {

palpate::detail::phantom::Functions phantom_functions() { return palpate::detail::phantom::bind_functions(&fake_function, "the stand-in"); }

std::string order_of_calls;
template <char Name>
unsigned note_call(void* more) {
  order_of_calls += Name;
  return more == nullptr ? 0 : 1;   // done, or again
}

}  // namespace

TEST_CASE("the stand-in is strict about frames, types and handles, and its errors are a stack", "[phantom]") {
  // Yardstick: the published rules of the interface. Without them "no violations" elsewhere would mean nothing.
  auto& fake = fresh_fake();
  auto const hd = phantom_functions();
  auto const last = [&] { return hd.next_error().code; };
  CHECK(last() == 0);
  CHECK(hd.init_device("Nobody's Device") == 0xFFFFFFFFu);
  CHECK(last() == 0x303);
  unsigned const device = hd.init_device(nullptr);
  REQUIRE(device != 0xFFFFFFFFu);
  CHECK(reinterpret_cast<unsigned (*)()>(fake_function("hdGetCurrentDevice"))() == device);
  CHECK(hd.init_device("Default Device") == 0xFFFFFFFFu);
  CHECK(last() == 0x301);

  std::array<double, 16> numbers{};
  std::array<int, 16> integers{};
  hd.get_doubles(0x2050, numbers.data());   // outside a frame
  CHECK(last() == 0x402);
  hd.set_doubles(0x2700, numbers.data());
  CHECK(last() == 0x402);
  hd.begin_frame(device);
  hd.get_integers(0x2050, integers.data());
  hd.get_doubles(0x1234, numbers.data());
  hd.get_doubles(0x2000, numbers.data());
  hd.enable(0x4711);
  hd.begin_frame(77);
  for (unsigned const code : {0x104u, 0x100u, 0x103u, 0x100u, 0x103u}) CHECK(last() == code);   // the newest first
  CHECK(fake.violations == 0);
  hd.begin_frame(device);
  CHECK(last() == 0x400);
  CHECK(fake.violations == 1);
  hd.end_frame(device);
  CHECK(last() == 0);
  hd.end_frame(device);
  CHECK(last() == 0x401);
  CHECK(fake.violations == 2);
  hd.update_calibration(4);   // a style that it has not
  CHECK(last() == 0x101);
  hd.disable_device(device);
  hd.disable_device(device);
  CHECK(last() == 0x104);
}

TEST_CASE("the stand-in's scheduler keeps priorities, has an end, and while it runs only its thread may call", "[phantom][threads]") {
  auto& fake = fresh_fake();
  auto const hd = phantom_functions();
  unsigned const device = hd.init_device(nullptr);
  int again = 0;
  std::vector<unsigned long> tasks;
  tasks.push_back(hd.schedule(&note_call<'c'>, &again, 10));
  tasks.push_back(hd.schedule(&note_call<'a'>, &again, 65535));
  tasks.push_back(hd.schedule(&note_call<'b'>, nullptr, 500));   // once
  for (int k = 0; k < 5; ++k) tasks.push_back(hd.schedule(&note_call<'d'>, nullptr, 0));
  static_cast<void>(hd.schedule(&note_call<'x'>, &again, 0));
  CHECK(hd.next_error().code == 0x501);
  order_of_calls.clear();
  hd.start_scheduler();
  CHECK(advance_fake(2) == 2);
  CHECK(order_of_calls == "abcddddd" "ac");
  CHECK(fake.violations == 0);
  std::array<double, 3> numbers{};
  hd.get_doubles(0x2050, numbers.data());
  CHECK(fake.violations == 1);
  CHECK(std::string(fake.violation.load()) == "hdGetDoublev");
  hd.stop_scheduler();
  hd.unschedule(tasks[0]), hd.unschedule(tasks[1]);
  CHECK(hd.next_error().code == 0);
  hd.unschedule(tasks[0]);
  CHECK(hd.next_error().code == 0x101);
  hd.disable_device(device);
}
