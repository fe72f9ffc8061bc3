// SPDX-License-Identifier: MIT
// A network of one layer maps nothing.
#include <palpate/palpate.hpp>

palpate::Network<double, 1, 5, 1> make() { return palpate::Network<double, 1, 5, 1>(palpate::Seed{1}); }
