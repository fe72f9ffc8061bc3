// SPDX-License-Identifier: MIT
#pragma once

#include "../picture.hpp"

namespace haptics {

using namespace drawing;

Picture bounces();
Picture restitution();
Picture controller_position();
Picture controller_energy();
Picture patches();
Picture moving_average();
Picture late_force();
Picture palpating();
Picture palpating_energy();
Picture safety();

}  // namespace haptics
