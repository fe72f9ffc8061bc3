// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/device/device_address.hpp>
#include <palpate/device/limit.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)
#include <dlfcn.h>
#define PALPATE_CAN_LOAD_LIBRARIES 1
#endif

/// What the adapters of drivers have in common: finding a vendor's library while the program runs, errors with the driver's number, the rise of the force,
/// and options in a device's address.
namespace palpate::detail {

/// An error of an adapter outside the servo tick: `Problem` lists what can go wrong.
template <class Problem>
class DriverError : public Error {
 public:
  Problem problem() const noexcept { return problem_; }
  /// The driver's own number; 0: it gave none.
  int native_code() const noexcept { return native_code_; }

 protected:
  DriverError(Problem problem, std::string const& text, int native_code) : Error(text), problem_(problem), native_code_(native_code) {}

 private:
  Problem problem_;
  int native_code_;
};

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

/// Empty where the variable is not set.
inline std::string environment(char const* variable) {
  char const* const value = std::getenv(variable);
  return value != nullptr ? value : "";
}

/// Where to look, in order. What was asked for, in the options or by the variable, is tried alone.
inline std::vector<std::string> library_candidates(std::string const& asked, char const* variable, std::vector<std::string> usual) {
  for (std::string const& path : {asked, environment(variable)})
    if (!path.empty()) return {path};
  return usual;
}

/// A driver's library as it was found on this machine: the functions that an adapter calls.
template <class Functions>
struct DriverLibrary {
  Functions functions;
  std::string path;
};

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

/// The force as it comes up, tick by tick, after whatever made it begin again.
///   force sent = ramp · limited(force wanted, largest force);   ramp: 0 → 1 within so many seconds
/// Cost       noexcept, no allocation: allowed in the servo tick.
class ForceRamp {
 public:
  ForceRamp(double seconds, double rate, Capabilities const& capabilities) noexcept
      : per_tick_(seconds > 0.0 ? 1.0 / (seconds * rate) : 1.0), capabilities_(capabilities) {}

  void begin_again() noexcept { share_ = 0.0; }
  Wrench<double> next(Wrench<double> const& wanted) noexcept {
    share_ = std::min(1.0, share_ + per_tick_);
    Wrench<double> const most = limited(wanted, capabilities_);
    return {.force = share_ * most.force, .torque = share_ * most.torque};
  }

 private:
  double per_tick_, share_ = 0.0;
  Capabilities capabilities_;
};

/// The rotation nearest to a matrix that almost is one: X ← (X + X⁻ᵀ)/2, the polar factor, quadratically.
/// Source     \cite higham1986, Newton's iteration
/// Limits     nothing for a matrix that is not finite, mirrors, or is far from a rotation.
template <RealScalar Scalar>
std::optional<Matrix<Scalar, 3, 3>> nearest_rotation(Matrix<Scalar, 3, 3> const& matrix) noexcept {
  if (!is_finite(matrix) || !(matrix.determinant() > Scalar(0.1))) return std::nullopt;
  Matrix<Scalar, 3, 3> rotation = matrix;
  for (int k = 0; k < 8; ++k) {
    Matrix<Scalar, 3, 3> const inverse = rotation.inverse();
    rotation = (rotation + inverse.transpose()) / 2;
  }
  if (!is_finite(rotation) || (matrix - rotation).norm() > Scalar(0.1)) return std::nullopt;
  return rotation;
}

/// Takes the orientation from a driver's matrix; one that is no rotation leaves it as it was.
inline void take_orientation(Matrix<double, 3, 3> const& matrix, DeviceState<double>& state) noexcept {
  if (auto const rotation = nearest_rotation<double>(matrix)) state.orientation = Eigen::Quaternion<double>(*rotation).normalized();
}

/// The options of an address that all adapters have.
template <class Options>
void take_driver_options(DeviceAddress const& address, Options& options) {
  options.rate = address.number("rate", options.rate);
  options.max_force = address.number("max_force", options.max_force);
  options.ramp = address.number("ramp", options.ramp);
}

}  // namespace palpate::detail
