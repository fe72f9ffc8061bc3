// SPDX-License-Identifier: MIT
// Tensor mass, a line each.
#include "problem.hpp"

#include <palpate/tissue/tensor_mass/corotated_tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>

namespace models {

namespace {

template <class Tensors>
auto tensors_of(TetrahedralMesh<double> const& mesh) {
  return Tensors(mesh, {.density = density, .material = {.young = young, .poisson = poisson}, .damping = {.alpha = drag}});
}

}  // namespace

std::vector<Row> tensors(Problem const& problem) {
  Headers const plain{"tissue/tensor_mass/tensor_mass.hpp", "tissue/tensor_mass/tensor_assembly.hpp", "tissue/tensor_mass/tensor_rows.hpp"};
  auto const linear = [](auto const& of) { return tensors_of<TensorMass<double>>(of); };
  auto const corotated = [](auto const& of) { return tensors_of<CorotatedTensorMass<double>>(of); };
  std::vector<Row> rows;
  rows.push_back(solid(problem, problem.coarse, "tensor mass", plain, linear));
  rows.push_back(solid(problem, problem.coarse, "tensor mass, corotated", {"tissue/tensor_mass"}, corotated));
  return rows;
}

}  // namespace models
