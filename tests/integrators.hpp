// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/explicit_midpoint.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/node_steps.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/stoermer_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/integrator/velocity_verlet.hpp>

#include <tuple>

/// Every integrator of the library, for TEMPLATE_LIST_TEST_CASE; integrator/test_order.cpp compares it with the headers.
using AllIntegrators =
    std::tuple<palpate::ExplicitEuler, palpate::SymplecticEuler, palpate::StoermerVerlet, palpate::LeapfrogVerlet, palpate::VelocityVerlet,
               palpate::ExplicitMidpoint, palpate::RungeKutta4, palpate::DormandPrince, palpate::BackwardEuler, palpate::CrankNicolson, palpate::ThetaScheme,
               palpate::NodeSteps>;
