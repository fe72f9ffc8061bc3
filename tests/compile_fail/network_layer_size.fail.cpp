// SPDX-License-Identifier: MIT
// expect: palpate::Network: every layer needs at least one neuron
// A hidden layer without neurons.
#include <palpate/palpate.hpp>

palpate::Network<double, 1, 0, 1> make() { return palpate::Network<double, 1, 0, 1>(palpate::Seed{1}); }
