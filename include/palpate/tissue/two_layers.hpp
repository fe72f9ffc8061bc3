// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <cstddef>
#include <utility>
#include <variant>

namespace palpate {

/// The law of a link of one of two layers: that of the skin, or that of what is inside.
/// Units      those of the two laws.
template <RealScalar Scalar, SpringLaw<Scalar> SkinLaw = LinearSpring<Scalar>, SpringLaw<Scalar> InnerLaw = LockingSpring<Scalar>>
class LayerSpring {
 public:
  Scalar damping = 0;   ///< N·s/m, of the law that it is made from; what counts

  static LayerSpring skin(SkinLaw const& law) { return LayerSpring(std::in_place_index<0>, law); }
  static LayerSpring inside(InnerLaw const& law) { return LayerSpring(std::in_place_index<1>, law); }

  LayerSpring() = default;   // of the skin, with its default law

  bool is_skin() const noexcept { return law_.index() == 0; }
  /// The law of that layer; null for a link of the other one.
  SkinLaw const* skin_law() const noexcept { return std::get_if<0>(&law_); }
  InnerLaw const* inner_law() const noexcept { return std::get_if<1>(&law_); }

  Scalar tension(Scalar elongation, Scalar rest_length) const noexcept {
    return of([&](auto const& law) { return static_cast<Scalar>(law.tension(elongation, rest_length)); });
  }
  Scalar tangent_stiffness(Scalar elongation, Scalar rest_length) const noexcept {
    return of([&](auto const& law) { return tangent_stiffness_of(law, elongation, rest_length); });
  }
  Scalar energy(Scalar elongation, Scalar rest_length) const noexcept {
    return of([&](auto const& law) { return energy_of(law, elongation, rest_length); });
  }
  bool monotone(Scalar rest_length) const noexcept {
    return of([&]<class Law>(Law const& law) {
      if constexpr (StatesMonotony<Law, Scalar>)
        return static_cast<bool>(law.monotone(rest_length));
      else
        return true;
    });
  }

 private:
  template <std::size_t layer, class Law>
  LayerSpring(std::in_place_index_t<layer> place, Law const& law) : damping(static_cast<Scalar>(law.damping)), law_(place, law) {}

  template <class Use>
  auto of(Use const& use) const noexcept {
    auto const* skin = std::get_if<0>(&law_);
    return skin != nullptr ? use(*skin) : use(*std::get_if<1>(&law_));
  }

  std::variant<SkinLaw, InnerLaw> law_;
};

/// What two_layers builds besides its laws.
template <RealScalar Scalar>
struct TwoLayerOptions {
  MassOptions<Scalar> mass{};
  HomeSpring<Scalar> home{};
  Scalar link_prestrain = 0;   ///< of both layers, see MassSpringOptions
};

/// A solid of springs in two layers: the links on edges of the border have the law of the skin, all others that of what is inside. A link that joins two
/// vertices of the border through the solid is inside.
///
///   auto const thigh = fill(make_thigh<double>(), {.edge = 0.025}).mesh;
///   auto tissue = two_layers(thigh, LinearSpring<double>{.stiffness = 150.0}, LockingSpring<double>{.stiffness = 60.0, .largest_tension = 0.6});
///   tissue.nail(thigh_bone(thigh));
///
/// The coefficients belong to this mesh. To find them from a measured indentation, give fit_stiffness a function that builds this with its values.
/// Units      as the laws have them; kg.
/// Source     \cite deformable_survey: the thigh, its skin linear, what is inside f = δ/(aδ + b), a = 1/largest_tension, b = 1/stiffness.
/// Errors     as MassSpring: InvalidMesh, InvalidArgument for the coefficients of either law.
/// Cuts       as MassSpring. New links have the law of the edge that was divided, so where a blade enters through an edge of the skin the new
///            links below it are those of skin, and what opens inside gets no skin.
/// Limits     springs do not keep a volume, whatever their law: docs/models.md has how much each loses.
template <RealScalar Scalar, SpringLaw<Scalar> SkinLaw, SpringLaw<Scalar> InnerLaw>
MassSpring<Scalar, LayerSpring<Scalar, SkinLaw, InnerLaw>> two_layers(TetrahedralMesh<Scalar> const& mesh, SkinLaw const& skin, InnerLaw const& inside,
                                                                      TwoLayerOptions<Scalar> const& options = {}) {
  using Spring = LayerSpring<Scalar, SkinLaw, InnerLaw>;
  MassSpring<Scalar, Spring> tissue(
      mesh, {.mass = options.mass, .link = Spring::inside(inside), .home = options.home, .link_prestrain = options.link_prestrain});
  auto const& border = tissue.surface();
  for (int t = 0; t < border.triangle_count(); ++t) {
    auto const c = border.corners(t);
    for (std::size_t k = 0; k < 3; ++k)
      if (int const a = c[k], b = c[(k + 1) % 3]; a < b) tissue.set_link(tissue.links().find(a, b), Spring::skin(skin));
  }
  return tissue;
}

}  // namespace palpate
