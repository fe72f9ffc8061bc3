// SPDX-License-Identifier: MIT
// A hidden layer without neurons.
#include <palpate/palpate.hpp>

palpate::Network<double, 1, 3, 1> make() { return palpate::Network<double, 1, 3, 1>(palpate::Seed{1}); }
