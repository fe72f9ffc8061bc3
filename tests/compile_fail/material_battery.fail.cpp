// SPDX-License-Identifier: MIT
// expect: palpate: the material has no stress_change(F, dF); declare: Tensor3<Scalar> stress_change(Tensor3<Scalar> const& F, Tensor3<Scalar> const& dF) const, in Pa.
// The law battery for a material that forgot how its stress changes.
#include <palpate/extend/material.hpp>

template <class T>
struct Foam {
  T stiffness{};
  T energy(palpate::Tensor3<T> const& F) const { return stiffness * (determinant(F, cofactor(F)) - 1) * (determinant(F, cofactor(F)) - 1); }
  palpate::Tensor3<T> stress(palpate::Tensor3<T> const& F) const { return (2 * stiffness * (determinant(F, cofactor(F)) - 1)) * cofactor(F); }
};

bool check() { return palpate::testing::check_material<double>(Foam<double>{1e4}).empty(); }
