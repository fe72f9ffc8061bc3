// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "phantom/fake.hpp"
#include "scratch_folder.hpp"

#include <palpate/device/phantom/library.hpp>

#include <cstdlib>
#include <map>
#include <optional>
#include <string>

using namespace palpate;
using palpate::detail::phantom::bind_functions;
using palpate::detail::phantom::library_candidates;
using palpate::detail::phantom::load_library;
using palpate_test::message_of;
using palpate_test::unsaid;

namespace {

/// A variable of the environment, as it was again at the end.
class PhantomVariable {
 public:
  PhantomVariable(std::string name, char const* value) : name_(std::move(name)) {
    if (char const* const before = std::getenv(name_.c_str())) before_ = before;
    set(value);
  }
  ~PhantomVariable() { set(before_ ? before_->c_str() : nullptr); }
  PhantomVariable(PhantomVariable const&) = delete;
  PhantomVariable& operator=(PhantomVariable const&) = delete;

 private:
  void set(char const* value) {
    if (value != nullptr)
      ::setenv(name_.c_str(), value, 1);
    else
      ::unsetenv(name_.c_str());
  }
  std::string name_;
  std::optional<std::string> before_;
};

}  // namespace

TEST_CASE("libHD is looked for where it was said to be, or in the usual places", "[phantom]") {
  ScratchFolder const scratch;
  std::filesystem::create_directories(scratch.path() / "lib64");
  scratch.write("lib64/libHD.so.3.4", "not a library\n");
  PhantomVariable const base("OH_SDK_BASE", scratch.path().c_str());
  {
    PhantomVariable const ours("PALPATE_LIBHD", "/some/libHD.so");
    CHECK(library_candidates("") == std::vector<std::string>{"/some/libHD.so"});
    CHECK(library_candidates("mine.so") == std::vector<std::string>{"mine.so"});
  }
  PhantomVariable const none("PALPATE_LIBHD", nullptr);
  auto const all = library_candidates("");
  REQUIRE(all.size() >= 5);
  CHECK(all.front() == "libHD.so");
  std::string const own = scratch.path() / "lib64" / "libHD.so.3.4";
  CHECK(all[4] == own);
  if (::dlopen("libHD.so", RTLD_LAZY | RTLD_LOCAL) != nullptr) return;   // OpenHaptics is installed here
  // The loader's own words: here the file that is none, and the names that are nowhere.
  CHECK(unsaid(message_of([] { static_cast<void>(load_library("")); }), "PHANToM: libHD could not be loaded", own,
               "not found: libHD.so, libHD.so.3.4,", "PALPATE_LIBHD") == "");
}

TEST_CASE("what can not be loaded is said in the loader's words", "[phantom]") {
  auto const load = [](std::string const& path) { return message_of([&] { static_cast<void>(load_library(path)); }); };
  CHECK(unsaid(load("/nowhere/libHD.so"), "/nowhere/libHD.so: cannot open shared object file", "Install OpenHaptics") == "");
  CHECK(unsaid(load("libm.so.6"), "libm.so.6 has no function hdInitDevice", "3.0 to 3.5") == "");
  try {
    static_cast<void>(load_library("libm.so.6"));
    FAIL("libm is not libHD");
  } catch (PhantomError const& error) {
    CHECK(error.problem() == PhantomProblem::library_incompatible);
  }
}

TEST_CASE("each function that is called is needed, and named when it is not there; the others may lack", "[phantom]") {
  // Yardstick: the functions that a session from opening to closing can not do without, counted by hand.
  std::map<std::string, bool> names;
  detail::phantom::Functions all;
  detail::phantom::for_each_function(all, [&](char const* name, auto&, bool mandatory) { names[name] = mandatory; });
  int mandatory = 0;
  for (auto const& [hidden, needed] : names) {
    auto const find = [&](char const* name) { return name == hidden ? nullptr : palpate_test::fake_function(name); };
    mandatory += needed ? 1 : 0;
    if (needed)
      CHECK(unsaid(message_of([&] { static_cast<void>(bind_functions(find, "old/libHD.so")); }), "old/libHD.so has no function " + hidden + ":") ==
            "");
    else
      CHECK_NOTHROW(bind_functions(find, "old/libHD.so"));
  }
  CHECK(mandatory == 19);
  for (char const* const unused : {"hdGetCurrentDevice", "hdIsEnabled", "hdGetBooleanv", "hdGetFloatv", "hdGetLongv", "hdScheduleSynchronous",
                                   "hdWaitForCompletion", "hdGetSchedulerTimeStamp"})
    CHECK(names.count(unused) == 0);   // a library that lacks one will do
}

TEST_CASE("the environment is described in one line", "[phantom]") {
  PhantomVariable const home("GTDD_HOME", "/usr/share/3DSystems");
  PhantomVariable const base("OH_SDK_BASE", nullptr);
  std::string const text = phantom_environment();
  CHECK(unsaid(text, "GTDD_HOME is /usr/share/3DSystems", "OH_SDK_BASE is not set", "/dev/") == "");
  CHECK(text.find('\n') == std::string::npos);
}
