// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <system_error>
#include <type_traits>

/// What the programs share that have options.
namespace command_line {

/// What is wrong. CLI11 2.1 names unknown words in reverse order: here as they were typed.
inline std::string words_of(CLI::App const& app, CLI::ParseError const& error) {
  if (dynamic_cast<CLI::ExtrasError const*>(&error) == nullptr) return error.what();
  std::string text = "not expected:";
  for (std::string const& word : app.remaining()) text += ' ' + word;
  return text;
}

/// Of a seed and its like: digits alone, of a number that 64 bits hold. CLI11 2.1 takes the largest one for what is larger.
inline CLI::Validator whole_number() {
  return {[](std::string& text) {
            std::uint64_t number = 0;
            auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
            bool const is_octal = text.size() > 1 && text.front() == '0';
            return error == std::errc() && end == text.data() + text.size() && !is_octal ? std::string() : "must be a whole number from 0 to 18446744073709551615: " + text;
          },
          "", ""};
}

/// From `low` to `high`, both included. CLI11 says of 2.5 and of 5kPa, too, that they are not in range: here that the one is no whole number, and the
/// other no number.
template <class Number>
CLI::Validator range(Number low, Number high) {
  CLI::Range const within(low, high);
  return {[within](std::string& text) {
            Number number{};
            bool is_one = CLI::detail::lexical_cast(text, number);
            if constexpr (std::is_integral_v<Number>)   // one that is too large for it is one all the same
              is_one = is_one || (!text.empty() && text.find_first_not_of("0123456789", text.front() == '-' ? 1 : 0) == std::string::npos);
            if (is_one) return within(text);
            return text + (std::is_integral_v<Number> ? " is no whole number" : " is no number; give it alone, without a unit");
          },
          within.get_description(), ""};
}

/// Reads the options, then calls `finish`, which may throw CLI::ValidationError. Returns nothing, or the exit code where there is nothing more to do: 0
/// after --help and --version, 2 after a mistake, which it names in one line on standard error.
template <class Finish>
std::optional<int> parse(CLI::App& app, char const* program, int argc, char** argv, Finish const& finish) {
  try {
    app.parse(argc, argv);
    for (CLI::Option const* option : app.get_options())
      for (std::string const& text : option->results())   // a range lets nan pass
        if (option->get_type_name().find("FLOAT") != std::string::npos && std::isnan(std::strtod(text.c_str(), nullptr)))
          throw CLI::ValidationError(option->get_name(), text + " is not a number");
    finish();
    return std::nullopt;
  } catch (CLI::ParseError const& error) {
    if (error.get_exit_code() == 0) return app.exit(error);   // --help, --version
    std::fprintf(stderr, "%s: %s (see %s --help)\n", program, words_of(app, error).c_str(), program);
    return 2;
  }
}

}  // namespace command_line
