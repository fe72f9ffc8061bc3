// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/material/corotational.hpp>
#include <palpate/material/presets.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <algorithm>
#include <numeric>
#include <set>
#include <sstream>
#include <string_view>
#include <type_traits>
#include <vector>

using namespace palpate;

namespace {

/// What the sources print, by hand: Young's modulus or shear modulus [Pa], density [kg/m³].
struct Printed {
  std::string_view name;
  double young, shear, density;
};
constexpr Printed printed[] = {{"liver", 2040, 0, 1060}, {"kidney", 0, 1810, 1050}, {"brain", 0, 900, 1040}, {"fat", 0, 752, 950}, {"skin", 129000, 0, 1090}, {"muscle", 0, 1000, 1050}};

}  // namespace

// Yardstick: the numbers that the sources print; E = 2 mu (1 + nu) where that is the shear modulus.
TEST_CASE("material presets have the numbers of their sources", "[material][presets]") {
  STATIC_REQUIRE(std::size(printed) == material_presets.size());
  for (Printed const& number : printed) {
    CAPTURE(number.name);
    auto const* preset = find_material_preset(number.name);
    REQUIRE(preset);
    CHECK(preset->density == number.density);
    CHECK(preset->poisson == assumed_poisson);
    auto const lame = lame_constants(preset->young, preset->poisson);
    if (number.young > 0)
      CHECK(preset->young == number.young);
    else
      CHECK(lame.mu == Approx(number.shear).epsilon(1e-12));
  }
  STATIC_REQUIRE(&liver_material == find_material_preset("liver"));
  STATIC_REQUIRE(&muscle_material == find_material_preset("muscle"));
  STATIC_REQUIRE(find_material_preset("spleen") == nullptr);
}

TEST_CASE("every material preset says what it was measured on", "[material][presets]") {
  std::set<std::string_view> names;
  for (MaterialPreset const& preset : material_presets) {
    CAPTURE(preset.name);
    CHECK(names.insert(preset.name).second);
    CHECK(find_material_preset(preset.name) == &preset);
    std::ostringstream text;
    text << preset;
    for (auto const part : {preset.name, preset.tissue, preset.species, preset.method, preset.strain, preset.measured, preset.source, preset.limits, material_density_source}) {
      CHECK_FALSE(part.empty());
      CHECK(text.str().find(part) != std::string::npos);
    }
    CHECK(text.str().find("an assumption") != std::string::npos);
    bool const can_be_opened = preset.source.find("doi 10.") != std::string_view::npos || preset.source.find("https://") != std::string_view::npos;
    CHECK(can_be_opened);
  }
}

// Yardstick: a cube sheared by gamma pulls at its top with mu gamma times the face, but for terms of gamma squared; its mass is density times volume.
TEMPLATE_TEST_CASE("a tissue is made of each material preset", "[material][presets]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  S const side = S(0.01), gamma = S(0.01);
  auto const mesh = make_block<S>(2, 2, 2, side);
  auto const check = [&]<class M>(MaterialPreset const& preset, M const& /*law*/) {
    FiniteElements<S, M> const tissue(mesh, {.density = static_cast<S>(preset.density), .material = preset});
    S mass = 0;
    for (int i = 0; i < tissue.size(); ++i) mass += tissue.mass(i);
    CHECK(mass == Approx(preset.density * 1e-6).epsilon(1e-5));

    std::vector<int> all(static_cast<std::size_t>(tissue.size()));
    std::iota(all.begin(), all.end(), 0);
    typename FiniteElements<S, M>::Assembly assembly;
    tissue.assemble(all, assembly);
    Matrix<S, 4, Dynamic> x = Matrix<S, 4, Dynamic>::Zero(4, mesh.points.cols()), still = x, f = x;
    x.topRows(3) = mesh.points;
    for (int i = 0; i < tissue.size(); ++i) x(0, i) += gamma * mesh.points(2, i);
    assembly.add_forces(x, still, f);
    S pull = 0;
    for (int i = 0; i < tissue.size(); ++i)
      if (mesh.points(2, i) > side / 2) pull -= f(0, i);
    CHECK(pull == Approx(preset.young / (2 * (1 + preset.poisson)) * 0.01 * 1e-4).epsilon(1e-3));
  };
  for (MaterialPreset const& preset : material_presets) {
    CAPTURE(preset.name);
    check(preset, StableNeoHookean<S>{});
    check(preset, Corotational<S>{});
  }
  FiniteElements<S, StableNeoHookean<S>> two(mesh, {.density = liver_material.density, .material = liver_material});   // as the header's comment has it
  two.set_material(std::vector<int>{0}, fat_material, fat_material.density);
  StableNeoHookean<S> const liver = liver_material;
  CHECK(liver.young == S(2040));
}
