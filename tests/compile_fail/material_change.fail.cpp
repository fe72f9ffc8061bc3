// SPDX-License-Identifier: MIT
// expect: palpate: the material has no stress_change(F, dF); declare: Tensor3<Scalar> stress_change(Tensor3<Scalar> const& F, Tensor3<Scalar> const& dF) const, in Pa.
// A material that forgot how its stress changes.
#include <palpate/palpate.hpp>

template <class T>
struct Foam {
  T stiffness{};
  T energy(palpate::Tensor3<T> const& F) const { return stiffness * (determinant(F, cofactor(F)) - 1) * (determinant(F, cofactor(F)) - 1); }
  palpate::Tensor3<T> stress(palpate::Tensor3<T> const& F) const { return (2 * stiffness * (determinant(F, cofactor(F)) - 1)) * cofactor(F); }
};

void build() {
  using namespace palpate;
  SoftBody body(FiniteElements<double, Foam<double>>(make_block<double>(3, 3, 3, 0.01), {.density = 1000.0, .material = {.stiffness = 1e4}}), BackwardEuler{});
}
