// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/detail/shared_library.hpp>
#include <palpate/device/phantom/abi.hpp>
#include <palpate/device/phantom/faults.hpp>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

namespace palpate::detail::phantom {

/// libHD as it was found on this machine, at run time.
/// Invariant  Never unloaded: the driver behind it does not stand being loaded twice.
struct Library {
  Functions functions;
  std::string path;
};

/// Where to look, in order. What was asked for, in the options or by PALPATE_LIBHD, is tried alone.
inline std::vector<std::string> library_candidates(std::string const& asked) {
  if (!asked.empty()) return {asked};
  if (char const* const path = std::getenv("PALPATE_LIBHD"); path != nullptr && *path != '\0') return {path};
  std::vector<std::string> const names{"libHD.so", "libHD.so.3.4", "libHD.so.3.4.0", "libHD.so.3.0"};
  std::vector<std::string> all = names, folders;
  if (char const* const base = std::getenv("OH_SDK_BASE"); base != nullptr && *base != '\0')
    for (char const* const below : {"/lib64", "/lib"}) folders.push_back(std::string(base) + below);
  for (char const* const folder : {"/usr/lib", "/usr/lib64", "/opt/OpenHaptics/Developer/3.4-0/lib64"}) folders.push_back(folder);
  for (std::string const& folder : folders)
    for (std::string const& name : names) {
      std::error_code problem;
      if (std::filesystem::exists(folder + "/" + name, problem)) all.push_back(folder + "/" + name);
    }
  return all;
}

/// Fills the table with what `find(name)` gives; throws for the first mandatory function that it does not know.
template <class Find>
Functions bind_functions(Find find, std::string const& path) {
  return bound_functions<Functions>(find, [&](char const* name) {
    throw PhantomError(
        PhantomProblem::library_incompatible,
        message(path, " has no function ", name, ": it is not libHD, or of a version that this adapter does not know (3.0 to 3.5 are meant)"));
  });
}

/// Loads the first library that can be loaded. Throws with every loader's message as it came: it names a library that is missing further down.
inline Library load_library(std::string const& asked) {
  static_assert(sizeof(void*) == 8 || sizeof(void*) == 4);
  if constexpr (!can_load_libraries) throw PhantomError(PhantomProblem::library_not_found, "libHD is loaded on Unix alone so far");
  if constexpr (sizeof(void*) != 8) throw PhantomError(PhantomProblem::library_incompatible, "libHD is used on 64-bit systems only");
  auto const candidates = library_candidates(asked);
  SharedLibrary library = load_first(candidates);
#if defined(PALPATE_CAN_LOAD_LIBRARIES)
  if (library.handle == nullptr && !library.problems.empty()) {   // perhaps it wants the driver's names to be there already
    bool found = false;
    for (char const* const driver : {"libPhantomIOLib42.so", "libPHANToMIO.so.4"})
      found = ::dlopen(driver, RTLD_NOW | RTLD_GLOBAL) != nullptr || found;
    if (found) library = load_first(candidates);
  }
#endif
  if (library.handle == nullptr)
    throw PhantomError(
        PhantomProblem::library_not_found,
        message("libHD could not be loaded: ", library.reason(),
                ". Install OpenHaptics and the device's driver, or say with PhantomOptions::library or the variable PALPATE_LIBHD where libHD is"));
  return {bind_functions([&](char const* name) { return function_of(library, name); }, library.path), library.path};
}

}  // namespace palpate::detail::phantom
