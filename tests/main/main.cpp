// SPDX-License-Identifier: MIT
// The entry point of every test program, for Catch2 2.13 and 3.
#if __has_include(<catch2/catch_session.hpp>)
#include <catch2/catch_session.hpp>
#else
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>
#endif

#include "skip.hpp"

int main(int argc, char* argv[]) {
  int const failed = Catch::Session().run(argc, argv);
  return failed == 0 && palpate_test::skipped() > 0 ? palpate_test::skip_code : failed;
}
