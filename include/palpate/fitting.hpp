// SPDX-License-Identifier: MIT
#pragma once

/// fitting: from measurements to coefficients. Not part of palpate.hpp.
#include <palpate/fitting/contact_models.hpp>
#include <palpate/fitting/fit.hpp>
#include <palpate/fitting/fit_network.hpp>
#include <palpate/fitting/fit_stiffness.hpp>
#include <palpate/fitting/fitted_force.hpp>
#include <palpate/fitting/indentation.hpp>
#include <palpate/fitting/least_squares.hpp>
#include <palpate/fitting/measurements.hpp>
#include <palpate/fitting/needle_model.hpp>
