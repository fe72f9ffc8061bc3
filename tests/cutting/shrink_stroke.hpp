// SPDX-License-Identifier: MIT
#pragma once

#include "shrink_lists.hpp"
#include "stroke_case.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

/// Makes a case that fails smaller while it still fails: fewer strokes, fewer ticks, no steps, one blade, the default snap, shorter numbers.
/// `fails(case)` says whether it does; it is asked `most` times at most.
template <class S, class Fails>
StrokeCase<S> shrunk(StrokeCase<S> strokes, Fails fails, int most = 4000) {
  auto const still = [&](StrokeCase<S> const& smaller) {
    if (most-- <= 0 || !fails(smaller)) return false;
    strokes = smaller;
    return true;
  };
  auto const drop = [&](auto list_of) { return drop_stretches(strokes, list_of, still); };
  for (bool again = true; again && most > 0;) {
    again = drop([](auto& c) -> auto& { return c.strokes; });
    for (std::size_t k = 0; k < strokes.strokes.size(); ++k)
      if (drop([k](auto& c) -> auto& { return c.strokes[k]; })) again = true;
    auto const simpler = [&](auto member, auto value) {
      if (strokes.*member == value) return;
      auto smaller = strokes;
      smaller.*member = value;
      if (still(smaller)) again = true;
    };
    simpler(&StrokeCase<S>::steps, 0);
    simpler(&StrokeCase<S>::crossings, 100);
    simpler(&StrokeCase<S>::blades, 1);
    simpler(&StrokeCase<S>::snap, std::optional<S>{});
  }
  for (double const unit : {1e-3, 1e-4, 1e-5, 1e-6})   // m; points need not be exact, most of them
    for (std::size_t k = 0; k < strokes.strokes.size(); ++k)
      for (std::size_t i = 0; i < strokes.strokes[k].size(); ++i) {
        auto smaller = strokes;
        auto& tip = smaller.strokes[k][i];
        for (int d = 0; d < 3; ++d) tip[d] = S(std::round(static_cast<double>(tip[d]) / unit) / std::round(1 / unit));
        if (tip != strokes.strokes[k][i]) still(smaller);
      }
  return strokes;
}

/// The case as a test case to be pasted, with numbers that read back exactly.
template <class S>
std::string to_test_case(StrokeCase<S> const& strokes, std::string const& violations) {
  auto const number = [](S value) {
    char text[40];
    for (int digits = 3; digits <= 17; ++digits) {   // the shortest that reads back
      std::snprintf(text, sizeof text, "%.*g", digits, static_cast<double>(value));
      if (S(std::strtod(text, nullptr)) == value) break;
    }
    return sizeof(S) == sizeof(float) ? "float(" + std::string(text) + ")" : std::string(text);
  };
  std::string const scalar = sizeof(S) == sizeof(float) ? "float" : "double";
  std::string text = "TEST_CASE(\"strokes that failed: name what it was\") {\n";
  for (std::size_t at = 0; at < violations.size();) {
    std::size_t const end = std::min(violations.find('\n', at), violations.size());
    text += "  // " + violations.substr(at, end - at) + "\n";
    at = end + 1;
  }
  text += "  StrokeCase<" + scalar + "> const strokes{.mesh = \"" + strokes.mesh + "\"";
  if (strokes.snap) text += ", .snap = " + number(*strokes.snap);
  if (strokes.steps != 0) text += ", .steps = " + std::to_string(strokes.steps);
  if (strokes.crossings != 100) text += ", .crossings = " + std::to_string(strokes.crossings);
  if (strokes.blades != 1) text += ", .blades = " + std::to_string(strokes.blades);
  text += ", .strokes = {";
  for (std::size_t k = 0; k < strokes.strokes.size(); ++k) {
    text += k == 0 ? "{" : ",\n      {";
    for (std::size_t i = 0; i < strokes.strokes[k].size(); ++i) {
      auto const& tip = strokes.strokes[k][i];
      if (i > 0) text += i % 3 == 0 ? ",\n       " : ", ";
      text += "{" + number(tip[0]) + ", " + number(tip[1]) + ", " + number(tip[2]) + "}";
    }
    text += "}";
  }
  return text + "}};\n  CHECK(violations_of(strokes) == \"\");\n}\n";
}
