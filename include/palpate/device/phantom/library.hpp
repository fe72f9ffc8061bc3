// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/phantom/abi.hpp>
#include <palpate/device/phantom/faults.hpp>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)
#include <dlfcn.h>
#define PALPATE_PHANTOM_CAN_LOAD 1
#endif

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
  Functions functions;
  for_each_function(functions, [&](char const* name, auto& pointer, bool mandatory) {
    void* const found = find(name);
    if (found == nullptr && mandatory)
      throw PhantomError(
          PhantomProblem::library_incompatible,
          message(path, " has no function ", name, ": it is not libHD, or of a version that this adapter does not know (3.0 to 3.5 are meant)"));
    pointer = reinterpret_cast<std::remove_reference_t<decltype(pointer)>>(found);
  });
  return functions;
}

/// Loads the first library that can be loaded. Throws with every loader's message as it came: it names a library that is missing further down.
inline Library load_library(std::string const& asked) {
#if defined(PALPATE_PHANTOM_CAN_LOAD)
  static_assert(sizeof(void*) == 8 || sizeof(void*) == 4);
  if constexpr (sizeof(void*) != 8) throw PhantomError(PhantomProblem::library_incompatible, "libHD is used on 64-bit systems only");
  auto const candidates = library_candidates(asked);
  std::string absent, problems;
  auto const try_all = [&]() -> void* {
    absent.clear(), problems.clear();
    for (std::string const& candidate : candidates) {
      if (void* const handle = ::dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL)) {
        absent = candidate;   // where it was
        return handle;
      }
      char const* const said = ::dlerror();
      std::string const text = said != nullptr ? said : "no reason given";
      if (candidates.size() > 1 && text.starts_with(candidate + ": cannot open shared object file"))
        absent += (absent.empty() ? "" : ", ") + candidate;
      else
        problems += (problems.empty() ? "" : "; ") + text;
    }
    return nullptr;
  };
  void* handle = try_all();
  if (handle == nullptr && !problems.empty()) {   // perhaps it wants the driver's names to be there already
    bool found = false;
    for (char const* const driver : {"libPhantomIOLib42.so", "libPHANToMIO.so.4"})
      found = ::dlopen(driver, RTLD_NOW | RTLD_GLOBAL) != nullptr || found;
    if (found) handle = try_all();
  }
  if (handle == nullptr)
    throw PhantomError(
        PhantomProblem::library_not_found,
        message("libHD could not be loaded: ", problems, problems.empty() || absent.empty() ? "" : "; ", absent.empty() ? "" : "not found: ", absent,
                ". Install OpenHaptics and the device's driver, or say with PhantomOptions::library or the variable PALPATE_LIBHD where libHD is"));
  return {bind_functions([handle](char const* name) { return ::dlsym(handle, name); }, absent), absent};
#else
  static_cast<void>(asked);
  throw PhantomError(PhantomProblem::library_not_found, "libHD is loaded on Unix alone so far");
#endif
}

}  // namespace palpate::detail::phantom
