// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace palpate {

/// The stiffness of the servo's spring that gives the tissue's own reaction at this depth, so that the hand feels what the body answers.
///   K = F·n / d, not below `least` nor above `most`; while d is below `shallow`, where the quotient says nothing, the last one
/// Units      N/m, m, N.
/// Invariant  0 < least ≤ most, shallow > 0, all finite; checked at set-up.
/// Cost       noexcept, no allocation.
/// Limits     A secant: where the tissue stiffens with the depth the hand feels its force at this depth, between two steps not its slope.
template <RealScalar S>
class SecantStiffness {
 public:
  SecantStiffness(S least, S most, S shallow = S(5e-4)) : least_(least), most_(most), shallow_(shallow), last_(least) {
    if (!(least > S(0)) || !std::isfinite(least))
      throw InvalidArgument(detail::message("SecantStiffness: the least is ", least, " N/m; give a finite number above zero"));
    if (!(most >= least) || !std::isfinite(most))
      throw InvalidArgument(detail::message("SecantStiffness: the most is ", most, " N/m; give a finite number, not below the least"));
    if (!(shallow > S(0)) || !std::isfinite(shallow))
      throw InvalidArgument(detail::message("SecantStiffness: shallow is ", shallow, " m; give a finite number above zero"));
  }

  /// For a reaction on the tool, at a depth along this normal. What is no number changes nothing.
  S operator()(Vector3<S> const& reaction, Vector3<S> const& normal, S depth) noexcept {
    if (depth >= shallow_)
      if (S const k = reaction.dot(normal) / depth; std::isfinite(k)) last_ = std::clamp(k, least_, most_);
    return last_;
  }

 private:
  S least_, most_, shallow_, last_;
};

}  // namespace palpate
