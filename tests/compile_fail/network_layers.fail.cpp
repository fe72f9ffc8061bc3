// SPDX-License-Identifier: MIT
// expect: palpate::Network: give the sizes of at least two layers
// A network of one layer maps nothing.
#include <palpate/palpate.hpp>

palpate::Network<double, 1> make() { return palpate::Network<double, 1>(palpate::Seed{1}); }
