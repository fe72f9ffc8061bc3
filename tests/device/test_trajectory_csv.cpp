// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "device/temporary_folder.hpp"

#include <palpate/device/trajectory.hpp>

#include <clocale>
#include <string>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::TemporaryFolder;
using palpate_test::unsaid;

namespace {

/// The message of the FileError that reading this content gives.
std::string complaint(std::string_view content) {
  TemporaryFolder const folder;
  auto const file = folder.file("path.csv", content);
  try {
    read_trajectory<double>(file);
  } catch (FileError const& error) {
    return error.what();
  }
  return "no error";
}

Trajectory<double> path_of(std::string_view content) {
  TemporaryFolder const folder;
  return Trajectory<double>::from_csv(folder.file("path.csv", content));
}

}  // namespace

TEMPLATE_TEST_CASE("a path in a file is followed straight from row to row", "[trajectory][csv]", PALPATE_TEST_SCALARS) {
  using Scalar = TestType;
  TemporaryFolder const folder;
  auto const path = Trajectory<Scalar>::from_csv(folder.file("path.csv", "time_s,x_m,y_m,z_m\n"
                                                                         "0,0,0,0.5\n"
                                                                         "1,1,0,0.5\n"
                                                                         "1.5,1,-1e0,0.25\n"));
  CHECK(path.duration() == 1.5);
  CHECK(path.at(0.0).position == Vector3<Scalar>(0, 0, 0.5));
  CHECK(path.at(0.25).position == Vector3<Scalar>(0.25, 0, 0.5));
  CHECK(path.at(0.25).velocity == Vector3<Scalar>(1, 0, 0));
  CHECK(path.at(1.25).position == Vector3<Scalar>(1, -0.5, 0.375));
  CHECK(path.at(1.25).velocity == Vector3<Scalar>(0, -2, -0.5));
  CHECK(path.at(9.0).position == Vector3<Scalar>(1, -1, 0.25));
}

TEST_CASE("rows are hit exactly at their times, however many there are", "[trajectory][csv]") {
  // Yardstick: the numbers written into the file. 20,000 steps of 1 ms from an odd start; positions to 1e-12 of a 1 m path.
  std::string text = "time_s,x_m,y_m,z_m\n";
  for (int i = 0; i <= 20000; ++i)
    text += std::to_string(1000 + i) + "e-3," + std::to_string(i % 97) + "e-2,0," + std::to_string(i % 13) + "e-3\n";
  auto const path = path_of(text);
  CHECK(path.duration() == 20.0);
  double worst = 0.0;
  for (int i = 0; i <= 20000; ++i) {
    Vector3<double> const written(i % 97 * 1e-2, 0.0, i % 13 * 1e-3);
    worst = std::max(worst, (path.at(i / 1000.0).position - written).norm());
  }
  CHECK(worst <= 1e-11);   // speeds reach 960 m/s at the saw's teeth, times are good to 4e-15 s
}

TEST_CASE("columns are found by name, in any order, and a recording is a path too", "[trajectory][csv]") {
  auto const expected = [](Trajectory<double> const& path) {
    return path.duration() == 2.0 && path.at(1.0).position == Vector3<double>(2, 3, 4);
  };
  CHECK(expected(path_of("z_m,note,time_s,y_m,x_m\n2,a,5,1,0\n6,b,7,5,4\n")));
  CHECK(expected(path_of("time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N\n"
                         "0,0,1,2,0,no contact,0,0,0\n2,4,5,6,0.001,moving,0,0,1\n")));
  CHECK(expected(path_of("tip_x_m,time_s,x_m,y_m,z_m\n9,0,0,1,2\n9,2,4,5,6\n")));   // both: the plain names win
}

TEST_CASE("what spreadsheets leave behind is not a mistake", "[trajectory][csv]") {
  auto const path = path_of("\xEF\xBB\xBF# drawn by hand\r\n\r\n \"time_s\" , x_m,\ty_m , z_m\r\n+0, +1 ,\"2\", 3\r\n\r\n2,3,4,5");
  CHECK(path.duration() == 2.0);
  CHECK(path.at(1.0).position == Vector3<double>(2, 3, 4));
}

TEST_CASE("the decimal point is a point in every locale", "[trajectory][csv]") {
  std::string const before = std::setlocale(LC_ALL, nullptr);
  for (char const* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    CHECK(path_of("time_s,x_m,y_m,z_m\n0,0.5,0,0\n1.5,0.5,0,0\n").at(0.0).position.x() == 0.5);
  }
  std::setlocale(LC_ALL, before.c_str());
}

TEST_CASE("each malformed path says what, where, and what to do", "[trajectory][csv]") {
  std::string const header = "time_s,x_m,y_m,z_m\n";

  SECTION("missing file, folder instead of a file") {
    TemporaryFolder const folder;
    CHECK_THROWS_AS(read_trajectory<double>(folder / "nowhere.csv"), FileError);
    CHECK(unsaid(message_of([&] { read_trajectory<double>(folder / "nowhere.csv"); }), "nowhere.csv: the file does not exist; check the path") == "");
    CHECK(unsaid(message_of([&] { read_trajectory<double>(folder.path()); }), "this is a folder; give a file") == "");
  }
  SECTION("empty") {
    CHECK(unsaid(complaint(""), "the file is empty", "time_s,x_m,y_m,z_m") == "");
    CHECK(unsaid(complaint("\n  \r\n# nothing\n"), "the file is empty") == "");
  }
  SECTION("fewer than two rows") {
    CHECK(unsaid(complaint(header), "there are 0 rows of numbers; a path needs two or more") == "");
    CHECK(unsaid(complaint(header + "0,0,0,0\n"), "there are 1 rows of numbers") == "");
  }
  SECTION("missing column, with what was found instead") {
    CHECK(unsaid(complaint("time_s,x_m,y_m\n0,0,0\n1,0,0\n"), "line 1: there is no column z_m; found: time_s, x_m, y_m") == "");
    CHECK(unsaid(complaint("time_s,x_mm,y_mm,z_mm\n"), "no column x_m; found: time_s, x_mm", "metres") == "");
    CHECK(unsaid(complaint("time_s;x_m;y_m;z_m\n"), "no column time_s", "separated by commas") == "");
    CHECK(unsaid(complaint("0,0,0,0\n1,0,0,0\n"), "no column time_s; found: 0, 0, 0, 0") == "");
    CHECK(unsaid(complaint("time_s,tip_x_m,tip_y_m,z_m\n"), "no column tip_z_m") == "");
  }
  SECTION("a cell that is not a number; the line counts comments and blank lines") {
    CHECK(unsaid(complaint(header + "0,0,0,0\n\n# comment\n1,0,left,0\n"), "path.csv, line 5: column y_m holds \"left\"", "not a number") == "");
    CHECK(unsaid(complaint(header + "0,0,,0\n"), "line 2: column y_m holds \"\"") == "");
    CHECK(unsaid(complaint(header + "0,0,1.5 m,0\n"), "line 2: column y_m holds \"1.5 m\"") == "");
    CHECK(unsaid(complaint(header + "0,0,+-1,0\n"), "holds \"+-1\"") == "");
    CHECK(unsaid(complaint(header + "0,0,1e999,0\n"), "holds \"1e999\"") == "");
  }
  SECTION("a value that is not finite") {
    CHECK(unsaid(complaint(header + "0,0,0,nan\n"), "line 2: column z_m holds \"nan\"; every value must be finite") == "");
    CHECK(unsaid(complaint(header + "inf,0,0,0\n"), "line 2: column time_s holds \"inf\"") == "");
  }
  SECTION("a value too large for the scalar") {
    TemporaryFolder const folder;
    auto const file = folder.file("path.csv", header + "0,1e300,0,0\n1,0,0,0\n");
    CHECK_NOTHROW(read_trajectory<double>(file));
    CHECK(unsaid(message_of([&] { read_trajectory<float>(file); }), "line 2: column x_m holds \"1e300\"") == "");
  }
  SECTION("time that does not grow") {
    CHECK(unsaid(complaint(header + "0,0,0,0\n1,0,0,0\n0.5,0,0,0\n"), "line 4: time_s is 0.5 after 1; times must grow from row to row") == "");
    CHECK(unsaid(complaint(header + "0,0,0,0\n0,1,0,0\n"), "line 3: time_s is 0 after 0") == "");
    CHECK(unsaid(complaint(header + "-1e308,0,0,0\n1e308,1,0,0\n"), "line 3: time_s") == "");
  }
  SECTION("a speed that is no number") {
    CHECK(unsaid(complaint(header + "0,0,0,0\n1e-320,45,0,0\n"), "line 3: the way from the row before, in 9.99988867e-321 s, is too fast to be a number") == "");
  }
  SECTION("cut short") {
    CHECK(unsaid(complaint(header + "0,0,0,0\n1,0,0\n"), "line 3: there are 3 cells where the first line names 4 columns") == "");
    CHECK(unsaid(complaint(header + "0,0,0,0,0\n"), "line 2: there are 5 cells") == "");
  }
}
