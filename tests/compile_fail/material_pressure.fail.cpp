// SPDX-License-Identifier: MIT
// expect: palpate: the material has no bulk_modulus(), which nodal pressure computes with; declare in its law: Scalar bulk_modulus() const, in Pa at small strain, or leave .pressure out: each tetrahedron then resists by itself.
// Nodal pressure of a material that does not say its bulk modulus.
#include <palpate/palpate.hpp>

/// psi = mu/2 (F : F - 3) - mu (J - 1) + k/2 (J - 1)^2.
struct Rubber {
  double mu = 1000, k = 10000;   // Pa
  double energy(palpate::Tensor3<double> const& F) const {
    double const volume = determinant(F, cofactor(F)) - 1;
    return mu / 2 * (double_contraction(F, F) - 3) - mu * volume + k / 2 * volume * volume;
  }
  palpate::Tensor3<double> stress(palpate::Tensor3<double> const& F) const {
    auto const cof = cofactor(F);
    return mu * F + (k * (determinant(F, cof) - 1) - mu) * cof;
  }
  palpate::Tensor3<double> stress_change(palpate::Tensor3<double> const& F, palpate::Tensor3<double> const& dF) const {
    auto const cof = cofactor(F);
    return mu * dF + (k * double_contraction(cof, dF)) * cof + (k * (determinant(F, cof) - 1) - mu) * cofactor_change(F, dF);
  }
};

void build() {
  using namespace palpate;
  FiniteElements<double, Rubber> tissue(make_block<double>(3, 3, 3, 0.01),
                                        {.density = 1000.0, .material = {}, .pressure = Pressure::nodal});
  tissue.size();
}
