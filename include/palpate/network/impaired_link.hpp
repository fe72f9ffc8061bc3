// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// What a way through a network does to messages of one direction.
struct Impairment {
  double delay = 0.0;        ///< s
  double jitter = 0.0;       ///< s, each message is up to that much earlier or later, evenly spread; none before it was sent
  double loss = 0.0;         ///< share of messages of which the first copy is lost, 0 … 0.9
  double burst = 1.0;        ///< messages lost in a row, on average
  double retransmit = 0.0;   ///< s until a lost one is sent again; 0: 2 · delay + 10 ms. Each further copy may be lost too, and waits twice as long
  std::vector<std::pair<double, double>> silences = {};   ///< s, from … to: nothing arrives, and what was sent arrives at the end
  std::uint64_t seed = 0;
};

/// One direction of a TCP connection through a bad network, on a virtual clock. TCP loses nothing and keeps the order: a lost message is a delay of all that
/// follow.
///   arrives = max(sent + delay + jitter + waits for copies, arrival of the one before)
/// Losses come in bursts by a chain of two states (Gilbert); the same seed gives the same times, whatever is in the messages.
/// Source     \cite gilbert1960
class ImpairedLink {
 public:
  explicit ImpairedLink(Impairment const& impairment = {}) : options_(impairment), random_(Seed{impairment.seed}) {
    detail::OptionCheck const require{"Impairment", true};
    require.not_negative(".delay", impairment.delay, " s");
    require.not_negative(".jitter", impairment.jitter, " s");
    require(impairment.loss >= 0.0 && impairment.loss <= 0.9, ".loss", impairment.loss, "give a share, 0 to 0.9");
    require(impairment.burst >= 1.0, ".burst", impairment.burst, "give 1 or more");
    require(impairment.burst * (1.0 - impairment.loss) >= impairment.loss, ".burst", impairment.burst, "losses of that share come in longer bursts: give at least loss / (1 - loss)");
    require.not_negative(".retransmit", impairment.retransmit, " s");
    double ended = 0.0;
    for (auto const& [from, to] : impairment.silences) {
      for (double const time : {from, to}) {
        require(time >= ended, ".silences", time, " s", "give times that rise");
        ended = time;
      }
    }
  }

  void send(std::span<std::byte const> message, double now) {
    double const jitter = options_.jitter * (2.0 * random_.uniform<double>() - 1.0);
    double arrives = now + std::max(0.0, options_.delay + jitter) + waits();
    for (auto const& [from, to] : options_.silences)
      if (arrives >= from && arrives < to) arrives = to;
    last_ = std::max(last_, arrives);
    under_way_.push_back({last_, {message.begin(), message.end()}});
    ++messages_, bytes_ += message.size();
  }
  /// use(bytes) for every message that has arrived by now, in their order.
  template <class Use>
  void receive(double now, Use const& use) {
    for (; !under_way_.empty() && under_way_.front().arrives <= now; under_way_.pop_front()) use(std::span<std::byte const>(under_way_.front().bytes));
  }

  std::uint64_t messages() const noexcept { return messages_; }
  std::uint64_t bytes() const noexcept { return bytes_; }
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  struct UnderWay {
    double arrives;
    std::vector<std::byte> bytes;
  };

  /// s, for the copies of one message.
  double waits() noexcept {
    if (!(options_.loss > 0.0)) return 0.0;
    double const stays = 1.0 - 1.0 / options_.burst, comes = options_.loss / (options_.burst * (1.0 - options_.loss));
    bad_ = random_.uniform<double>() < (bad_ ? stays : comes);
    if (!bad_) return 0.0;
    ++lost_;
    double const once = options_.retransmit > 0.0 ? options_.retransmit : 2.0 * options_.delay + 0.01;
    double all = once;
    for (int copy = 1; copy < 6 && random_.uniform<double>() < options_.loss; ++copy) all += std::ldexp(once, copy);
    return all;
  }

  Impairment options_;
  Random random_;
  std::deque<UnderWay> under_way_;
  double last_ = 0.0;
  bool bad_ = false;
  std::uint64_t messages_ = 0, bytes_ = 0, lost_ = 0;
};

}  // namespace palpate
