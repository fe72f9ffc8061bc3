// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace palpate {

struct WeberDeadbandOptions {
  double fraction = 0.0;      ///< k, of the force that is felt; 0.05 to 0.15 for what a hand does not notice. 0: everything is sent
  double floor = 0.005;       ///< N, an absolute one: near a force of zero k F would send everything
  double keep_alive = 0.02;   ///< s, after which it is sent in any case; at most 0.05, since both sides take 0.1 s without news for a partner that is gone
};

/// Perceptual coding: sends what would change the force that is felt by more than a hand notices, and leaves out the rest.
///   sends where  ΔF > max(k F, floor),  or where keep_alive has passed since the last one
/// Source     Weber's law for forces, and its use on a channel: \cite hinterseer2008.
/// Invariant  0 ≤ k < 1, floor ≥ 0, 0 < keep_alive ≤ 50 ms; checked at set-up. What is left out changes the force by no more than max(k F, floor).
/// Cost       O(1), noexcept, no allocation.
class WeberDeadband {
 public:
  explicit WeberDeadband(WeberDeadbandOptions const& options = {}) : options_(options) {
    detail::OptionCheck const require{"WeberDeadband", true};
    require(options.fraction >= 0.0 && options.fraction < 1.0, ".fraction", options.fraction, "give 0 to 1, 0.1 for what a hand does not notice");
    require.not_negative(".floor", options.floor, " N");
    require(options.keep_alive > 0.0 && options.keep_alive <= 0.05, ".keep_alive", options.keep_alive, " s", "give 0.001 to 0.05: both sides take 0.1 s without news for a partner that is gone");
  }

  /// Is it to be sent? `change` is by how much the force would differ from that with what was sent last, `force` what is felt [N]; `anyway`: whatever they are.
  bool operator()(double change, double force, double now, bool anyway = false) noexcept {
    bool const sends = anyway || !(options_.fraction > 0.0) || !(change <= std::max(options_.fraction * force, options_.floor)) || !(now - last_ < options_.keep_alive);
    ++(sends ? sent_ : left_out_);
    if (sends) last_ = now;
    return sends;
  }
  void reset() noexcept { last_ = -std::numeric_limits<double>::infinity(); }

  std::uint64_t sent() const noexcept { return sent_; }
  std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  WeberDeadbandOptions options_;
  double last_ = -std::numeric_limits<double>::infinity();
  std::uint64_t sent_ = 0, left_out_ = 0;
};

}  // namespace palpate
