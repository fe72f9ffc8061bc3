// SPDX-License-Identifier: MIT
#pragma once

// What a solid that is cut is made of: 10 kPa, ν = 0.4, 1000 kg/m³.
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/tensor_mass/corotated_tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>

#include <tuple>

namespace palpate_test {

template <template <class> class Tissue>
struct SolidOf {
  template <class S>
  static auto tissue(palpate::TetrahedralMesh<S> const& mesh, S prestrain, S alpha = 0) {
    return Tissue<S>(mesh, {.density = 1000, .material = {.young = S(1e4), .poisson = S(0.4)}, .damping = {.alpha = alpha}, .prestrain = prestrain});
  }
};
template <class S>
using NeoHookeanElements = palpate::FiniteElements<S, palpate::StableNeoHookean<S>>;

using Elements = SolidOf<NeoHookeanElements>;
using Tensors = SolidOf<palpate::TensorMass>;
using Turned = SolidOf<palpate::CorotatedTensorMass>;
using Solids = std::tuple<Elements, Tensors>;

}  // namespace palpate_test
