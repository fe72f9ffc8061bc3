// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/body_shape.hpp>

#include <concepts>
#include <type_traits>

namespace palpate {

namespace detail {

/// A SoftBody, whatever its integrator and region.
template <class Body>
concept HasShape = std::derived_from<Body, BodyShape<typename Body::Tissue>>;

/// A soft body as what touches and cuts it sees it, so that this is compiled once for all bodies of a tissue. Other bodies stay what they are.
template <class Body>
auto& shape_of(Body& body) noexcept {
  if constexpr (HasShape<Body>)
    return static_cast<std::conditional_t<std::is_const_v<Body>, BodyShape<typename Body::Tissue> const, BodyShape<typename Body::Tissue>>&>(body);
  else
    return body;
}

}  // namespace detail

}  // namespace palpate
