// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/contact/obstacle.hpp>
#include <palpate/cutting/concept.hpp>

#include <cstddef>
#include <tuple>
#include <utility>

namespace palpate {

/// What one tool does to each body of a scene: a cutter for each, in their order. A cutter that is not in one acts on all bodies, a copy of it on each.
///   Tool(device, PerBody(ProgressiveCutter<double>(), VolumeCutter<double>({.edge = {{0, 0, 0}, {0, 0, 0.02}}})), force)
/// On an obstacle a tool never acts but as a NoCutter of its tip's radius.
template <class... Cutters>
struct PerBody {
  explicit PerBody(Cutters... cutters) : each(std::move(cutters)...) {}
  std::tuple<Cutters...> each;
};

namespace detail {

template <class B>
inline constexpr bool is_obstacle = false;
template <RealScalar Scalar>
inline constexpr bool is_obstacle<Obstacle<Scalar>> = true;

/// Whether a cutter acts on all of these.
template <class CutterType, class... Bodies>
inline constexpr bool cuts_each = ((is_obstacle<Bodies> || Cutter<CutterType, Bodies>) && ...);
template <class... Cutters, class... Bodies>
  requires(sizeof...(Cutters) == sizeof...(Bodies))
inline constexpr bool cuts_each<PerBody<Cutters...>, Bodies...> = ((is_obstacle<Bodies> || Cutter<Cutters, Bodies>) && ...);

}  // namespace detail

}  // namespace palpate
