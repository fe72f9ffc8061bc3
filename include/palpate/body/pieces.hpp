// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/mesh/detail/surface_sides.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

namespace detail {

/// A body whose tissue says which of its particles belong together.
template <class B>
concept HasPieces = HasParticles<typename TissueOf<B>::type>;

/// Says, where it is instantiated, that B is none.
template <class B>
struct PiecesSentences {
  static_assert(HasPieces<B>, "palpate: pieces are those of a body whose tissue has for_each_neighbour, as a SoftBody's; of a tissue make one: SoftBody body(std::move(tissue)).");
};

}  // namespace detail

/// The particles of each piece of a body, in rising order: two belong together where a chain of neighbours joins them. Pieces come in the order of their
/// first particle. Particles that no tetrahedron holds any more are of none.
/// Cost       O(body); allocates.
template <detail::HasPieces Body>
std::vector<std::vector<int>> pieces_of(Body const& body) {
  detail::DisjointSets joined(static_cast<std::size_t>(body.size()));
  for (int i = 0; i < body.size(); ++i) body.tissue().for_each_neighbour(i, [&](int j) { joined.join(i, j); });
  return joined.sets([&](int i) { return body.tissue().mass(i) > 0; });
}
template <class Other>
  requires(!detail::HasPieces<Other>)
std::vector<std::vector<int>> pieces_of(Other const&) {
  return (void(detail::PiecesSentences<Other>{}), std::vector<std::vector<int>>{});
}

/// Holds the pieces in which nothing is nailed or held, such as a cut frees them, so that statics has an equilibrium where gravity would carry them away.
/// Returns their particles: release() lets each go again.
/// Limits     A piece that home or support springs tie to its place is taken for free too.
/// Cost       O(body); allocates.
template <detail::HasPieces Body>
std::vector<int> hold_free_pieces(Body& body) {
  std::vector<int> held;
  for (auto const& piece : pieces_of(body)) {
    if (std::ranges::any_of(piece, [&](int i) { return body.tissue().nailed(i) || body.is_held(i); })) continue;
    for (int const i : piece) body.hold(i);
    held.insert(held.end(), piece.begin(), piece.end());
  }
  return held;
}
template <class Other>
  requires(!detail::HasPieces<Other>)
std::vector<int> hold_free_pieces(Other&) {
  return (void(detail::PiecesSentences<Other>{}), std::vector<int>{});
}

/// A body of its own of some of a body's particles, one or more whole pieces: with their shape, motion, forces, nails and hands, at the same time.
/// Particle k of it is particles[k] of the whole, which stays as it is.
///
///   auto const pieces = pieces_of(body);   // after a cut that has freed one
///   auto specimen = part_of(body, pieces[1]);
///
/// Errors     InvalidArgument where the particles are not whole pieces, or while a cut is in progress; OutOfRange for a bad index.
/// Cost       O(body); allocates.
template <class Body>
  requires DivisibleTissue<typename detail::TissueOf<Body>::type>
Body part_of(Body const& body, std::span<int const> particles) {
  if (!body.temporary_subdivisions().empty()) throw InvalidArgument("no piece can be taken out while a cut is in progress; lift the tool first");
  auto state = body.save();
  auto tissue = body.tissue().part(particles);   // checks the list
  std::vector<int> now(static_cast<std::size_t>(body.size()), -1);
  for (std::size_t k = 0; k < particles.size(); ++k) now[static_cast<std::size_t>(particles[k])] = static_cast<int>(k);
  auto const follow = [&](std::vector<int>& list) {
    std::vector<int> kept;
    for (int const i : list)   // one that was there in the last step may be gone
      if (i < body.size() && now[static_cast<std::size_t>(i)] >= 0) kept.push_back(now[static_cast<std::size_t>(i)]);
    list = std::move(kept);
  };
  for (auto* const list : {&state.held, &state.forced, &state.disturbed, &state.moving.particles, &state.moving.border}) follow(*list);
  state.evened = state.disturbed.size();
  state.tissue = std::move(tissue);
  state.solid_edits.clear();   // it is made of what it is made of now
  state.layout = {}, state.search_layout = {};
  state.particles = state.particles.part(particles);
  state.tree = SurfaceTree<typename Body::Scalar>(state.particles.position.view(), state.tissue.surface().triangles());
  state.tree_is_fitted = true;
  Body made = body;
  made.restore(state);
  return made;
}
/// Of what is no such body: what is wrong.
template <class Other>
  requires(!DivisibleTissue<typename detail::TissueOf<Other>::type>)
Other part_of(Other const& other, std::span<int const>) {
  static_assert(DivisibleTissue<typename detail::TissueOf<Other>::type>,
                "part_of: this is no body of tissue that makes tissue of its pieces, see DivisibleTissue; SoftBody of FiniteElements or MassSpring is one.");
  return other;
}

}  // namespace palpate
