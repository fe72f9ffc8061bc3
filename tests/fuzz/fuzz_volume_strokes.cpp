// SPDX-License-Identifier: MIT
// Strokes out of any bytes through a small solid of finite elements or of springs, everything checked after every tick: what no cut may change, and what the sanitizers see.
// A tick is seven bytes: what is done, and both ends of the blade on a lattice of which some planes are the mesh's own. A case that fails is made smaller, tick
// by tick, and printed.
//
//   cmake --preset fuzz && cmake --build --preset fuzz && build/fuzz/tests/fuzz/fuzz_volume_strokes -max_len=300 -max_total_time=600
#include <palpate/body/soft_body.hpp>
#include <palpate/core/error.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

using namespace palpate;

using Tick = std::array<std::uint8_t, 7>;

struct Solid {
  BlockPattern pattern;
  bool springs;
};

template <class S, class Tissue>
std::string violations_in(Tissue tissue, std::vector<Tick> const& ticks) {
  for (int i = 0; i < 9; ++i) tissue.nail(i);
  SoftBody body(std::move(tissue), BackwardEuler{});
  auto const saved = body.save();
  testing::SolidCutInvariants before(body, {.min_height = 0.0199 * static_cast<double>(body.mean_edge())});
  std::array knives{VolumeCutter<S>{}, VolumeCutter<S>({.max_tetrahedra = 30})};
  for (Tick const& tick : ticks) {
    auto const end = [&](std::size_t first) {
      Vector3<S> x;
      for (int k = 0; k < 3; ++k) x[k] = S(0.000125) * S(int{tick[first + static_cast<std::size_t>(k)]} - 80);   // 40 steps an edge
      return x;
    };
    auto& knife = knives[tick[0] & 1];
    switch (tick[0] >> 1 & 7) {
      case 0: knife.lift(body); break;
      case 1: body.restore(saved); break;
      case 2: body.step(S(1e-3)); [[fallthrough]];
      default:
        try {
          knife.advance(body, {end(1), end(4)});
        } catch (InvalidArgument const&) {   // a blade without length is refused, and the tick not taken: all that is checked holds
          if (end(1) != end(4)) throw;
        }
    }
    if (auto const found = testing::to_text(before.check(body)); !found.empty()) return found;
  }
  return {};
}

template <class S>
std::string violations_of(std::vector<Tick> const& ticks, Solid const& solid) {
  auto const mesh = make_block<S>(3, 3, 4, S(0.005), solid.pattern);
  if (solid.springs) return violations_in<S>(MassSpring<S>(mesh, {.mass = {.total = S(0.002)}, .link = {.stiffness = 50, .damping = S(0.01)}, .home = {.stiffness = 1}}), ticks);
  return violations_in<S>(FiniteElements<S, StableNeoHookean<S>>(mesh, {.density = 1000, .material = {.young = S(1e4), .poisson = S(0.4)}}), ticks);
}

template <class S>
void check(std::vector<Tick> ticks, Solid const& solid) {
  if (violations_of<S>(ticks, solid).empty()) return;
  for (bool smaller = true; smaller;) {
    smaller = false;
    for (std::size_t k = 0; k < ticks.size() && !smaller; ++k) {
      auto fewer = ticks;
      fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
      if (!violations_of<S>(fewer, solid).empty()) ticks = fewer, smaller = true;
    }
  }
  std::fprintf(stderr, "%zu ticks, %s, %s, %s:\n", ticks.size(), sizeof(S) == sizeof(float) ? "float" : "double",
               solid.pattern == BlockPattern::kuhn ? "kuhn" : "alternating", solid.springs ? "springs" : "elements");
  for (Tick const& tick : ticks) std::fprintf(stderr, "  {%d, %d, %d, %d, %d, %d, %d},\n", tick[0], tick[1], tick[2], tick[3], tick[4], tick[5], tick[6]);
  std::fputs(violations_of<S>(ticks, solid).c_str(), stderr);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  if (size < 8) return 0;
  std::vector<Tick> ticks;
  for (std::size_t at = 1; at + 7 <= size && ticks.size() < 40; at += 7) {
    Tick& tick = ticks.emplace_back();
    for (std::size_t k = 0; k < 7; ++k) tick[k] = data[at + k];
  }
  Solid const solid{(data[0] & 1) != 0 ? BlockPattern::kuhn : BlockPattern::alternating, (data[0] & 48) == 16};
  if ((data[0] & 14) == 2)
    check<float>(ticks, solid);
  else
    check<double>(ticks, solid);
  return 0;
}
