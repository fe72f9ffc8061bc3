// SPDX-License-Identifier: MIT
#pragma once

#include "../picture.hpp"

namespace forces {

using namespace drawing;

Picture contact_laws();
Picture hunt_crossley();
Picture liver_loop();
Picture puncture();
Picture domain_guard();
Picture blade();
Picture speed_network();
Picture organ_over_depth();
Picture organ_over_speed();
Picture noise_spectra();
Picture noise_in_time();
Picture needle();

}  // namespace forces
