// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/tissue/element_tissue.hpp>
#include <palpate/tissue/linear_tetrahedron.hpp>

#include <span>
#include <utility>

namespace palpate {

/// What a solid is made of.
template <RealScalar Scalar, class M>
struct SolidOptions {
  Scalar density{};   ///< kg/m³
  M material{};
};

/// An elastic solid: linear tetrahedra of a material, total Lagrangian, their mass lumped at the nodes.
///
///   FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(21, 5, 5, 0.0025, BlockPattern::alternating),
///                                                           {.density = 1060.0, .material = {.young = 2e5, .poisson = 0.45}});
///   tissue.nail(0);
///   SoftBody body(std::move(tissue), BackwardEuler{});
///
/// What a law of numbers or packs of numbers says (see MaterialLaw) is computed for as many elements at once as a register holds.
/// Units      kg, m, N, Pa.
/// Errors     InvalidMesh: a tetrahedron that is flat, turned over or joins a vertex with itself. InvalidArgument: a density that is not positive; what the
///            material says of its numbers.
/// Limits     near ν = ½ linear tetrahedra are far too stiff. Their surface is not cut.
template <RealScalar Scalar, Material<Scalar> M>
class FiniteElements : public ElementTissue<Scalar, LinearTetrahedron<Scalar, typename detail::LawOf<M>::type>> {
  using Law = detail::LawOf<M>;

 public:
  using Element = LinearTetrahedron<Scalar, typename Law::type>;
  using Options = SolidOptions<Scalar, M>;

  FiniteElements(TetrahedralMesh<Scalar> const& mesh, Options const& options)
      : ElementTissue<Scalar, Element>(mesh, elements(mesh, Law::of(options.material), (detail::require_positive("the density", options.density, "kg/m3"), options.density))) {}

  int tetrahedra() const noexcept { return static_cast<int>(this->template elements<Element>().elements.size()); }

  /// These tetrahedra are of another material from now on, and weigh what it does.
  void set_material(std::span<int const> some, M const& material, Scalar density) {
    detail::require_positive("the density", density, "kg/m3");
    auto const law = Law::of(material);
    for (int const t : some) detail::check_index("tetrahedron", t, tetrahedra());
    this->template change_elements<Element>(some, [&](auto const& rest, Element const&) { return Element(rest, law, density); });
  }

  using ElementTissue<Scalar, Element>::elements;

 private:
  static ElementList<Element> elements(TetrahedralMesh<Scalar> const& mesh, typename Law::type const& law, Scalar density) {
    require_valid(mesh);
    return make_elements(mesh.points, mesh.tetrahedra, [&](auto const& rest) { return Element(rest, law, density); });
  }
};

}  // namespace palpate
