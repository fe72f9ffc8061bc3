// SPDX-License-Identifier: MIT
// A material with all that it needs.
#include <palpate/extend/material.hpp>

template <class T>
struct Foam {
  T stiffness{};
  T energy(palpate::Tensor3<T> const& F) const { return stiffness * (determinant(F, cofactor(F)) - 1) * (determinant(F, cofactor(F)) - 1); }
  palpate::Tensor3<T> stress(palpate::Tensor3<T> const& F) const { return (2 * stiffness * (determinant(F, cofactor(F)) - 1)) * cofactor(F); }
  palpate::Tensor3<T> stress_change(palpate::Tensor3<T> const& F, palpate::Tensor3<T> const& dF) const {
    return (2 * stiffness * double_contraction(cofactor(F), dF)) * cofactor(F) + (2 * stiffness * (determinant(F, cofactor(F)) - 1)) * cofactor_change(F, dF);
  }
};

bool check() { return palpate::testing::check_material<double>(Foam<double>{1e4}).empty(); }
