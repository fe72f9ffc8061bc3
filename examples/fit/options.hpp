// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace fit_example {

/// What the command line asks for: one of data, generate and check.
struct Options {
  std::filesystem::path data;    ///< measurements to fit
  std::string generate;          ///< "liver" or "needle"
  std::filesystem::path check;   ///< a force file

  std::string model = "all";
  std::string source;            ///< of the measurements; empty: only the file's name is known
  double confidence = 0.95;
  std::uint64_t seed = 0;
  std::filesystem::path out;     ///< folder of the results, or the file that is generated; empty: a default
  bool pictures = true;
};

/// The options, or the exit code when there is nothing more to do: 0 after --help and --version, 2 after a mistake, which has been
/// named in one line on standard error.
struct Parsed {
  Options options;
  std::optional<int> exit_code;
};
Parsed parse_options(int argc, char** argv);

}  // namespace fit_example
