// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/explicit_midpoint.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/stoermer_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/integrator/velocity_verlet.hpp>

namespace work_precision {

/// All that are compared, in every scene and every chart. Yours is one line more: compare("MyScheme", MyScheme{});
template <class Compare>
void for_each_integrator(Compare const& compare) {
  using namespace palpate;
  compare("ExplicitEuler", ExplicitEuler{});
  compare("SymplecticEuler", SymplecticEuler{});
  compare("StoermerVerlet", StoermerVerlet{});
  compare("LeapfrogVerlet", LeapfrogVerlet{});
  compare("VelocityVerlet", VelocityVerlet{});
  compare("ExplicitMidpoint", ExplicitMidpoint{});
  compare("RungeKutta4", RungeKutta4{});
  compare("BackwardEuler", BackwardEuler{});
  compare("ThetaScheme 0.6", ThetaScheme{.theta = 0.6});
  compare("CrankNicolson", CrankNicolson{});
  compare("DormandPrince", [](double tolerance) { return DormandPrince{.relative = tolerance}; });
}

}  // namespace work_precision
