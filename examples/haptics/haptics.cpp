// SPDX-License-Identifier: MIT
// Draws the pictures of docs/rendering.md, and prints the numbers that the page quotes.
#include "../draw_pictures.hpp"
#include "pictures.hpp"

int main(int argc, char** argv) {
  using namespace haptics;
  return draw_pictures("haptics", argc, argv,
                       {bounces, restitution, controller_position, controller_energy, moving_average, late_force, patches, palpating,
                        palpating_energy, safety});
}
