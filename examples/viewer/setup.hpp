// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/training/configuration.hpp>

#include <filesystem>
#include <string>

namespace viewer {

using Vector = palpate::Vector3<double>;
using Mesh = palpate::TriangleMesh<double>;

enum class TissueName { soft, firm, solid };
enum class IntegratorName { leapfrog, backward_euler };
enum class Coupling { loose, tight, proxy };
enum class Blade { none, progressive, separating };

constexpr char const* to_string(TissueName name) noexcept { return name == TissueName::soft ? "soft" : name == TissueName::firm ? "firm" : "solid"; }
constexpr char const* to_string(IntegratorName name) noexcept { return name == IntegratorName::leapfrog ? "leapfrog" : "backward Euler"; }
constexpr char const* to_string(Coupling coupling) noexcept {
  return coupling == Coupling::loose ? "loose, force curves" : coupling == Coupling::tight ? "tight, tissue reaction" : "proxy, with friction";
}
constexpr char const* to_string(Blade blade) noexcept {
  return blade == Blade::none ? "none, palpate only" : blade == Blade::progressive ? "progressive" : "separating";
}

constexpr TissueName after(TissueName name) noexcept { return name == TissueName::soft ? TissueName::firm : name == TissueName::firm ? TissueName::solid : TissueName::soft; }
constexpr IntegratorName after(IntegratorName name) noexcept {
  return name == IntegratorName::leapfrog ? IntegratorName::backward_euler : IntegratorName::leapfrog;
}
constexpr Coupling after(Coupling coupling) noexcept {
  return coupling == Coupling::loose ? Coupling::tight : coupling == Coupling::tight ? Coupling::proxy : Coupling::loose;
}
constexpr Blade after(Blade blade) noexcept {
  return blade == Blade::none ? Blade::progressive : blade == Blade::progressive ? Blade::separating : Blade::none;
}

/// What the keys switch.
struct Setup {
  TissueName tissue = TissueName::soft;
  IntegratorName integrator = IntegratorName::leapfrog;
  Coupling coupling = Coupling::loose;
  Blade blade = Blade::progressive;
  int vertices = 2000;                           // of the library's own liver
  std::filesystem::path mesh;                    // empty: that liver
  std::string unit = "m", up = "auto";           // of the mesh
};

/// The numbers behind a tissue's name. Stiffness and damping are per mass of a particle, so that any resolution swings alike.
struct TissueValues {
  double link_stiffness, link_damping, home_stiffness, home_damping;   // 1/s², 1/s
  double puncture_depth;      // m
  double resistance;          // N/m, of the force curves before the puncture
  double curve_factor;        // the published liver curve times this
};

constexpr TissueValues values_of(TissueName name) noexcept {
  if (name == TissueName::firm) return {140000.0, 12.0, 70000.0, 500.0, 0.006, 320.0, 8.0};
  return {62500.0, 6.0, 25000.0, 310.0, 0.008, 167.0, 4.0};
}

/// What a recording keeps of the setup.
inline palpate::Configuration configuration_of(Setup const& setup) {
  palpate::Configuration configuration;
  configuration.set("tissue", to_string(setup.tissue)).set("integrator", to_string(setup.integrator));
  configuration.set("coupling", to_string(setup.coupling)).set("cutter", to_string(setup.blade));
  if (setup.mesh.empty())
    configuration.set("organ.vertices", setup.vertices);
  else
    configuration.set("organ.mesh", setup.mesh.string()).set("organ.unit", setup.unit).set("organ.up", setup.up);
  return configuration;
}

}  // namespace viewer
