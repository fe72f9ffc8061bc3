// SPDX-License-Identifier: MIT
#pragma once

/// A spring law of one's own: all that it takes. The page to this header is docs/new_law.md.
///
/// Required, together the concept SpringLaw<Law, Scalar>
///   Scalar tension(Scalar elongation, Scalar rest_length) const             m, m → N; positive: it pulls the ends together
///   Scalar damping                                                          a data member, N·s/m, ≥ 0
///   copyable; an aggregate with defaults, so that .link = {...} names its coefficients
/// Optional; static_assert(StatesEnergy<MyLaw, double>) finds a misspelt one
///   Scalar tangent_stiffness(Scalar elongation, Scalar rest_length) const   dT/dδ [N/m]                           StatesStiffness
///   Scalar energy(Scalar elongation, Scalar rest_length) const              ∫T dδ from 0 [J]                      StatesEnergy
///   bool monotone(Scalar rest_length) const                                 T grows with δ from −L on             StatesMonotony
///   void validate() const                                                   throws InvalidArgument, says which coefficient    Validatable
///   Scalar stiffness                                                        a data member that a fit looks for    HasStiffness
/// Battery
///   testing::to_text(testing::check_spring_law(MyLaw{...}, 0.01)) == ""     0.01 m: the rest length; its type is the scalar
/// In use
///   MassSpring<double, MyLaw> tissue(mesh, {.mass = {.total = 0.1}, .link = {...}});   palpate/tissue/mass_spring.hpp

#include <palpate/testing/spring_law.hpp>
#include <palpate/tissue/spring_law.hpp>

namespace palpate::testing {

/// The least law: what every SpringLaw has and nothing else. T = 50 N/m · δ, undamped.
template <RealScalar Scalar>
struct LawArchetype {
  Scalar damping = 0;   // N·s/m
  Scalar tension(Scalar elongation, Scalar) const { return 50 * elongation; }
};

}  // namespace palpate::testing
