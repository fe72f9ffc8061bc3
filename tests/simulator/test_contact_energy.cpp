// SPDX-License-Identifier: MIT
// By hand: energies before, in and after each contact are written down, the differences follow.
#include "catch.hpp"

#include <palpate/simulator/recording.hpp>

using namespace palpate;

TEST_CASE("each contact has the energy between the tick before it and the one that ends it", "[simulator][contact_energy]") {
  using enum CuttingPhase;
  Recording recording;
  double time = 0.0;
  auto const add = [&](CuttingPhase phase, double energy) { recording.append({.time = time++, .phase = phase, .energy = energy}); };
  add(no_contact, 0.0), add(no_contact, 0.5);
  add(indenting, 0.5), add(indenting, 2.0), add(no_contact, 0.25);          // −0.25, from 1 to 4
  add(no_contact, 0.25), add(moving, 0.75), add(moving, 1.0), add(no_contact, 1.25);   // 1, from 5 to 8
  add(indenting, 1.25), add(indenting, 3.0);                                // 1.75, not over
  auto const contacts = contact_energies(recording);
  REQUIRE(contacts.size() == 3);
  CHECK((contacts[0].begin == 1.0 && contacts[0].end == 4.0 && contacts[0].energy == -0.25 && !contacts[0].cut));
  CHECK((contacts[1].begin == 5.0 && contacts[1].end == 8.0 && contacts[1].energy == 1.0 && contacts[1].cut));
  CHECK((contacts[2].begin == 8.0 && contacts[2].end == 10.0 && contacts[2].energy == 1.75));
  CHECK(contact_energies({}).empty());
}

TEST_CASE("a recording that begins in contact counts from its first tick", "[simulator][contact_energy]") {
  Recording recording;
  recording.append({.time = 0.0, .phase = CuttingPhase::indenting, .energy = 0.0});
  recording.append({.time = 1.0, .phase = CuttingPhase::indenting, .energy = 0.5});
  auto const contacts = contact_energies(recording);
  REQUIRE(contacts.size() == 1);
  CHECK((contacts[0].begin == 0.0 && contacts[0].end == 1.0 && contacts[0].energy == 0.5));
}
