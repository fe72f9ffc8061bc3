// SPDX-License-Identifier: MIT
// Draws the pictures of docs/forces.md, one of each force model, and prints the numbers that the page quotes.
#include "../draw_pictures.hpp"
#include "pictures.hpp"

int main(int argc, char** argv) {
  using namespace forces;
  return draw_pictures("forces", argc, argv,
                       {contact_laws, hunt_crossley, puncture, liver_loop, domain_guard, blade, speed_network, organ_over_depth, organ_over_speed,
                        noise_spectra, noise_in_time, needle});
}
