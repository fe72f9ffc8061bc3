// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/detail/shared_library.hpp>
#include <palpate/device/force_dimension/abi.hpp>
#include <palpate/device/force_dimension/faults.hpp>

#include <cstdlib>
#include <string>
#include <vector>

namespace palpate::detail::force_dimension {

struct Library {
  Functions functions;
  std::string path;
};

/// In order. What was asked for, in the options or by PALPATE_LIBDHD, is tried alone. libdrd holds all that libdhd does.
inline std::vector<std::string> library_candidates(std::string const& asked) {
  if (!asked.empty()) return {asked};
  if (char const* const path = std::getenv("PALPATE_LIBDHD"); path != nullptr && *path != '\0') return {path};
  return {"libdrd.so", "libdhd.so", "libdrd.so.3", "libdhd.so.3"};
}

/// Fills the table with what `find(name)` gives; throws for the first mandatory function that it does not know.
template <class Find>
Functions bind_functions(Find find, std::string const& path) {
  return bound_functions<Functions>(find, [&](char const* name) {
    throw ForceDimensionError(ForceDimensionProblem::library_incompatible,
                              message(path, " has no function ", name,
                                      ": it is neither libdhd nor libdrd, or of a version that this adapter does not know (3.17 is meant)"));
  });
}

/// Loads the first library that can be loaded. Throws with the loader's messages as they came.
inline Library load_library(std::string const& asked) {
  if constexpr (!can_load_libraries) throw ForceDimensionError(ForceDimensionProblem::library_not_found, "libdhd is loaded on Unix alone so far");
  SharedLibrary const library = load_first(library_candidates(asked));
  if (library.handle == nullptr)
    throw ForceDimensionError(ForceDimensionProblem::library_not_found,
                              message("libdhd could not be loaded: ", library.reason(),
                                      ". Install the vendor's SDK, or say with ForceDimensionOptions::library or the variable PALPATE_LIBDHD where "
                                      "libdrd or libdhd is"));
  return {bind_functions([&](char const* name) { return function_of(library, name); }, library.path), library.path};
}

}  // namespace palpate::detail::force_dimension
