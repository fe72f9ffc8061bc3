// SPDX-License-Identifier: MIT
// When pictures are due and how they are drawn, by a clock that this program moves.
#include "../picture_clock.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>

namespace {

using viewer::PictureClock;
using std::chrono::milliseconds;

struct Seen {
  int pictures = 0, panels = 0;
};

/// A window that asks each millisecond, and takes `cost` to draw a picture, `hiccup` for the tenth.
Seen draw_for(PictureClock& clock, PictureClock::Clock::time_point& now, milliseconds time, milliseconds cost, milliseconds hiccup) {
  Seen seen;
  for (auto const end = now + time; now < end; now += milliseconds(1)) {
    if (!clock.is_due(now)) continue;
    bool const with_panel = clock.is_panel_due(now);
    auto const from = now;
    now += ++seen.pictures == 10 ? hiccup : cost;
    seen.panels += with_panel;
    clock.drew(from, now, with_panel);
  }
  return seen;
}

bool say(bool good, char const* what, Seen const& seen, PictureClock const& clock) {
  std::printf("%s%s: %d pictures, %d panels, %s, %.1f a second\n", good ? "" : "FAILED: ", what, seen.pictures, seen.panels, clock.is_plain() ? "plain" : "whole",
              clock.rate());
  return good;
}

}  // namespace

int main() {
  bool good = true;
  auto const begin = PictureClock::Clock::time_point(std::chrono::hours(1));
  {   // a card that waits for its screen, and stumbles: no picture is ever without its panel
    PictureClock clock;
    auto now = begin;
    Seen const seen = draw_for(clock, now, milliseconds(4000), milliseconds(15), milliseconds(400));
    good &= say(!clock.is_plain() && seen.panels == seen.pictures && std::abs(clock.rate() - 1000.0 / 16) < 1.0, "a card", seen, clock);
  }
  {   // a slow card is not helped by what is cheaper for a processor
    PictureClock clock;
    auto now = begin;
    Seen const seen = draw_for(clock, now, milliseconds(4000), milliseconds(60), milliseconds(60));
    good &= say(!clock.is_plain() && seen.panels == seen.pictures, "a slow card", seen, clock);
  }
  {   // many processors
    PictureClock clock;
    clock.begin_by_processor();
    auto now = begin;
    Seen const seen = draw_for(clock, now, milliseconds(4000), milliseconds(9), milliseconds(300));
    good &= say(!clock.is_plain() && seen.panels == seen.pictures, "fast processors", seen, clock);
  }
  {   // two: four slow pictures, then cheap ones each 30 ms, a panel each 90 ms
    PictureClock clock;
    clock.begin_by_processor();
    auto now = begin;
    Seen const slow = draw_for(clock, now, milliseconds(4 * 150), milliseconds(150), milliseconds(0));
    good &= say(slow.pictures == 4 && slow.panels == 4 && clock.is_plain() && clock.count() == 0, "slow processors", slow, clock);
    Seen const plain = draw_for(clock, now, milliseconds(6000), milliseconds(22), milliseconds(22));
    good &= say(std::abs(plain.pictures - 200) <= 1 && std::abs(plain.panels - 67) <= 1, "then", plain, clock);
    good &= say(std::abs(clock.rate() - 1000.0 / 30) < 1.0 && std::abs(clock.mean_rate() - 1000.0 / 30) < 0.5, "their rate", plain, clock);
    Seen const late = draw_for(clock, now, milliseconds(3000), milliseconds(22), milliseconds(500));
    good &= say(late.pictures >= 84 && late.pictures <= 86, "and one that took 500 ms", late, clock);   // not made up for
  }
  return good ? 0 : 1;
}
