// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

namespace palpate_test {

/// One or two edits of a file: a character changed, some taken out, a number put in.
inline void damage(std::string& text, std::mt19937_64& random) {
  for (std::uint64_t edits = 1 + random() % 2; edits > 0; --edits) {
    std::size_t const at = random() % text.size(), length = random() % 6;
    switch (random() % 3) {
      case 0: text[at] = static_cast<char>(' ' + random() % 90); break;
      case 1: text.erase(at, length); break;
      default: text.insert(at, std::to_string(static_cast<long long>(random() >> (20 + random() % 44)))); break;
    }
  }
}

}  // namespace palpate_test
