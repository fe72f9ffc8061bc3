// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Eigenvalues>

namespace palpate_test {

/// The largest modulus of an eigenvalue: below 1 a linear loop calms down. For one size of matrix alone, which all tests share: it takes long to compile.
inline double spectral_radius(Eigen::MatrixXd const& loop) { return loop.eigenvalues().cwiseAbs().maxCoeff(); }

}  // namespace palpate_test
