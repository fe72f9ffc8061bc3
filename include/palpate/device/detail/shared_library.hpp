// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <type_traits>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)
#include <dlfcn.h>
#define PALPATE_CAN_LOAD_LIBRARIES 1
#endif

namespace palpate::detail {

/// A shared library of a driver, or the loader's message.
/// Invariant  Never unloaded: drivers do not stand being loaded twice.
struct SharedLibrary {
  void* handle = nullptr;   // null: not loaded
  std::string path;         // as the loader was asked for it
  std::string absent;       // candidates that are nowhere, where there were several
  std::string problems;     // of the others, in the loader's words, which name a library that is missing further down

  /// What of the two there is.
  std::string reason() const { return problems + (problems.empty() || absent.empty() ? "" : "; ") + (absent.empty() ? "" : "not found: ") + absent; }
};

#if defined(PALPATE_CAN_LOAD_LIBRARIES)
constexpr bool can_load_libraries = true;

/// The first of the candidates that can be loaded.
inline SharedLibrary load_first(std::vector<std::string> const& candidates) {
  SharedLibrary result;
  for (std::string const& candidate : candidates) {
    if (void* const handle = ::dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL)) return {.handle = handle, .path = candidate, .absent = {}, .problems = {}};
    char const* const said = ::dlerror();
    std::string const text = said != nullptr ? said : "no reason given";
    if (candidates.size() > 1 && text.starts_with(candidate + ": cannot open shared object file"))
      result.absent += (result.absent.empty() ? "" : ", ") + candidate;
    else
      result.problems += (result.problems.empty() ? "" : "; ") + text;
  }
  return result;
}

inline void* function_of(SharedLibrary const& library, char const* name) { return ::dlsym(library.handle, name); }
#else
constexpr bool can_load_libraries = false;
inline SharedLibrary load_first(std::vector<std::string> const&) { return {}; }
inline void* function_of(SharedLibrary const&, char const*) { return nullptr; }
#endif

/// Fills a table of functions, which `for_each_function(table, visit)` goes through, with what `find(name)` gives; calls refuse(name) for a mandatory one
/// that is not there.
template <class Functions, class Find, class Refuse>
Functions bound_functions(Find find, Refuse refuse) {
  Functions functions;
  for_each_function(functions, [&](char const* name, auto& pointer, bool mandatory) {
    void* const found = find(name);
    if (found == nullptr && mandatory) refuse(name);
    pointer = reinterpret_cast<std::remove_reference_t<decltype(pointer)>>(found);
  });
  return functions;
}

}  // namespace palpate::detail
