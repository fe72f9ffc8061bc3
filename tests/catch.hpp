// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

// Catch2 2.13 (Debian 12) and Catch2 3 under one name. Tests include this and nothing else of Catch2; both give ::Approx.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif

// What a test is run with that says nothing of one of them alone. The sanitizers take double only; a test that looks at how numbers lie in
// memory names both by itself.
#ifndef PALPATE_TEST_SCALARS
#define PALPATE_TEST_SCALARS float, double
#endif

namespace palpate_test {

#if __has_include(<catch2/catch_all.hpp>)
using TextMatcher = Catch::Matchers::MatcherBase<std::string>;
#else
using TextMatcher = Catch::MatcherBase<std::string>;
#endif

class Says : public TextMatcher {
 public:
  explicit Says(std::vector<std::string> parts) : parts_(std::move(parts)) {}
  bool match(std::string const& text) const override {
    for (std::string const& part : parts_)
      if (text.find(part) == std::string::npos) return false;
    return true;
  }
  std::string describe() const override {
    std::string all = "says";
    for (std::string const& part : parts_) all += " \"" + part + "\"";
    return all;
  }

 private:
  std::vector<std::string> parts_;
};

}  // namespace palpate_test

/// Matches an error that has these parts: the offending value as it is written there, and what to do about it. The words around them are free to change.
///   CHECK_THROWS_WITH(Proxy({.stiffness = -1.0}), says(".stiffness is -1 N/m", "above zero"));
template <class... Parts>
palpate_test::Says says(Parts const&... parts) {
  return palpate_test::Says({std::string(parts)...});
}
