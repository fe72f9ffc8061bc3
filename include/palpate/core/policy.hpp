// SPDX-License-Identifier: MIT
#pragma once

namespace palpate {

/// Refinement of any policy: checks its options when it is put to use, and throws InvalidArgument.
template <class T>
concept Validatable = requires(T const& policy) { policy.validate(); };

/// Refinement of any policy with a state: starts anew.
template <class T>
concept Resettable = requires(T& policy) { policy.reset(); };

namespace detail {

/// A policy of which a sentence has said already what is wrong: nothing more is said of it.
template <class T>
concept IsRefused = requires { typename T::Refused; };

}  // namespace detail

}  // namespace palpate
