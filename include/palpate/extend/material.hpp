// SPDX-License-Identifier: MIT
#pragma once

/// A material of one's own for elastic solids: all that it takes. The page to this header is docs/new_material.md.
///
/// Required, together the concept MaterialLaw<Law, Scalar>; F: the deformation gradient, a Tensor3
///   Scalar energy(Tensor3<Scalar> const& F) const                          ψ per volume of the undeformed tissue [J/m³], 0 at F = 1
///   Tensor3<Scalar> stress(Tensor3<Scalar> const& F) const                 P = ∂ψ/∂F, first Piola–Kirchhoff [Pa], 0 at F = 1
///   Tensor3<Scalar> stress_change(Tensor3<Scalar> const& F, Tensor3<Scalar> const& dF) const   ∂P/∂F : dF [Pa]
///   copyable; an aggregate, so that .material = {...} names its coefficients
/// As a template over its numbers, template <class T> struct MyLaw { T ...; }, it is computed for as many elements at once as a register holds, if it is isotropic
/// or says what of its tangent is semidefinite. Then write palpate::number<T>(0.5) for a constant, palpate::each(x, function) for a function of one number, and no
/// comparison. What is made of a user's two numbers first, like Lamé's constants, is a struct with law() const, which returns the law: the concept Material.
/// Optional; static_assert(IsIsotropicLaw<MyLaw<double>>) finds a misspelt one
///   static constexpr bool isotropic = true                                 ψ depends on the principal stretches alone      IsIsotropicLaw
///   T bulk_modulus() const                                                 κ at small strain [Pa], for Pressure::nodal     HasBulkModulus
///   Tensor3<T> semidefinite_stress_change(F, dF) const                     a positive semidefinite part of the tangent     HasSemidefiniteStressChange
///   tangent_law() const                                                    a law whose positive semidefinite tangent is to be taken    HasTangentLaw
/// Battery
///   testing::to_text(testing::check_material<double>(MyLaw<double>{...})) == ""
/// In use
///   FiniteElements<double, MyLaw<double>> tissue(mesh, {.density = 1000.0, .material = {...}});   palpate/tissue/finite_elements.hpp

#include <palpate/core/tensor3.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/testing/material.hpp>

namespace palpate::testing {

/// The least material: what every MaterialLaw has and nothing else. ψ = c/2 (F : F − 3) − c (J − 1) + c (J − 1)², c = 1 kPa.
template <RealScalar Scalar>
struct MaterialArchetype {
  Scalar c = 1000;   // Pa
  Scalar energy(Tensor3<Scalar> const& F) const { return c * ((double_contraction(F, F) - 3) / 2 + volume(F) * (volume(F) - 1)); }
  Tensor3<Scalar> stress(Tensor3<Scalar> const& F) const { return c * (F + (2 * volume(F) - 1) * cofactor(F)); }
  Tensor3<Scalar> stress_change(Tensor3<Scalar> const& F, Tensor3<Scalar> const& dF) const {
    return c * (dF + (2 * volume(F) - 1) * cofactor_change(F, dF) + (2 * double_contraction(cofactor(F), dF)) * cofactor(F));
  }

 private:
  static Scalar volume(Tensor3<Scalar> const& F) { return determinant(F, cofactor(F)) - 1; }   // J − 1
};

}  // namespace palpate::testing
