// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "device/message.hpp"
#include "scratch_folder.hpp"

#include <palpate/core/units.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/volume/read_gmsh.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <sstream>
#include <string>
#include <vector>

using namespace palpate;
using palpate_test::message_of, palpate_test::unsaid;

// Written by hand after the Gmsh reference manual, "Legacy formats" and "MSH file format": two tetrahedra over a triangle, the second inside out, a vertex of none.
namespace {

std::string const first = R"($NOD
6
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 1
50 1 1 1
60 9 9 9
$ENDNOD
$ELM
3
1 2 1 1 3 10 20 30
2 4 1 1 4 10 20 30 40
3 4 1 1 4 20 30 40 50
$ENDELM
)";
std::string const second = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
3 1 "liver"
$EndPhysicalNames
$Nodes
6
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 1
50 1 1 1
60 9 9 9
$EndNodes
$Elements
4
1 15 2 1 1 10
2 2 2 1 1 10 20 30
3 4 2 1 1 10 20 30 40
4 4 0 20 30 40 50
$EndElements
)";
std::string const fourth = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
0 0 0 1
1 0 0 0 1 1 1 0 0
$EndEntities
$Nodes
2 6 10 60
2 1 0 2
10
20
0 0 0
1 0 0
3 1 1 4
30
40
50
60
0 1 0 0.5 0.5 0.5
0 0 1 0.5 0.5 0.5
1 1 1 0 0 0
9 9 9 0 0 0
$EndNodes
$Elements
2 3 1 3
2 1 2 1
1 10 20 30
3 1 4 2
2 10 20 30 40
3 20 30 40 50
$EndElements
)";

std::string with(std::string text, std::string const& what, std::string const& by) {
  auto const at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

}  // namespace

TEST_CASE("three versions of a Gmsh file give the same two tetrahedra", "[volume][gmsh]") {
  for (auto const& text : {first, second, fourth}) {
    auto const mesh = parse_gmsh(text, 0.01);
    REQUIRE(mesh.points.cols() == 5);
    REQUIRE(mesh.tetrahedra.cols() == 2);
    CHECK(mesh.points(2, 4) == 0.01);
    CHECK(validate(mesh).empty());
    CHECK(volume(mesh) == Approx(1e-6 * (1.0 / 6 + 1.0 / 3)).epsilon(1e-12));   // by determinants
  }
  CHECK(parse_gmsh(with(second, "20 1 0 0", "\n  \n\t20\t1 0 0  ")).points.cols() == 5);
  std::string dos;
  for (char const c : second) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
  CHECK(parse_gmsh<float>(dos).tetrahedra.cols() == 2);
}

TEST_CASE("a Gmsh file is read from disk and named in what is wrong with it", "[volume][gmsh]") {
  ScratchFolder const folder;
  auto const file = folder.write("liver.msh", second);
  CHECK(read_gmsh(file).points.cols() == 5);
  folder.write("liver.msh", with(second, "10 0 0 0", "10 0 zero 0"));
  CHECK(unsaid(message_of([&] { read_gmsh(file); }), "liver.msh, line 10", "\"zero\"", "coordinate") == "");
  CHECK_THROWS_AS(read_gmsh(folder.path() / "none.msh"), FileError);
  CHECK(unsaid(message_of([&] { read_gmsh(file, -1.0); }), "metres per unit", "-1") == "");
}

TEST_CASE("what is wrong with a Gmsh file is said in one line", "[volume][gmsh]") {
  auto const says = [](std::string const& text, auto const&... words) {
    std::string const said = message_of([&] { parse_gmsh(text); });
    CHECK(unsaid(said, words...) == "");
    CHECK(said.find('\n') == std::string::npos);
    CHECK_THROWS_AS(parse_gmsh(text), FileError);
  };
  says("", "no vertices");
  says("solid liver\n", "line 1", "\"solid\"", "Gmsh");
  says(with(second, "2.2 0 8", "2.2 1 8"), "line 2", "binary", "Mesh.Binary");
  says(with(second, "2.2 0 8", "4 0 8"), "version \"4\"", "2.2 or 4.1");
  says(with(second, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", ""), "$MeshFormat");
  says(second.substr(0, second.find("50 1 1 1")), "ends where a vertex", "cut short");
  says(second.substr(0, second.find("$Elements")), "no elements");
  says(second.substr(0, second.find("0 20 30 40 50") + 12), "vertex 5,", "ends in this line", "cut short");
  says(second.substr(0, second.find("0 20 30 40 50") + 10), "nothing", "a corner", "ends in this line", "cut short");
  says(second.substr(0, second.find("50 1 1 1") + 7), "nothing stands where a coordinate", "ends in this line", "cut short");
  CHECK(message_of([&] { parse_gmsh(with(second, "0 20 30 40 50", "0 20 30 40 5")); }).find("ends in this line") == std::string::npos);
  says(with(second, "$Nodes\n6", "$Nodes\n5"), "$EndNodes", "announces");
  says(with(second, "$Nodes\n6", "$Nodes\n600000000000"), "can not hold");
  says(with(second, "$Nodes\n6", "$Nodes\n-1"), "-1");
  says(with(second, "20 1 0 0", "10 1 0 0"), "vertex 10", "twice");
  says(with(second, "20 1 0 0", "20 1 nan 0"), "\"nan\"");
  says(with(second, "1 1 10 20 30 40", "1 1 10 20 30 41"), "line", "vertex 41");
  says(with(second, "1 1 10 20 30 40", "1 1 10 20 30"), "nothing", "corner");
  says(with(with(second, "4 2 1 1 10 20 30 40", "4 1 1 1 10 20 30 40"), "60 9 9 9", "1 9 9 9"), "line", "\"40\" follows the four corners");   // a tag that is a vertex's, too
  says(with(second, "1 1 10 20 30 40", "1 1 10 20 30 30"), "names vertex", "more than once");
  says(with(second, "0 20 30 40 50", "0 40 30 20 10"), "same corners");
  says(with(second, "40 0 0 1", "40 0.5 0.5 0"), "no volume");
  says(with(second, "4 4 0 20 30 40 50", "4 11 0 20 30 40 50"), "type 11", "ElementOrder");
  says(with(with(second, "3 4 2 1 1 10 20 30 40", "3 2 2 1 1 10 20 30"), "4 4 0 20 30 40 50", "4 2 0 20 30 40"), "no tetrahedra");
  says(with(fourth, "2 6 10 60", "2 7 10 60"), "7 vertices are announced");
  says(with(second, "$EndPhysicalNames\n", ""), "$PhysicalNames", "no end");
  says(with(first, "$ELM", "$Elements"), "$Elements");
}

// Vertices of none come first and between, so that those of the mesh have other numbers than those of the file.
TEST_CASE("a Gmsh file's vertices and tetrahedra are told from 0 in the order of the file", "[volume][gmsh]") {
  auto const said = [](std::string const& nodes, std::string const& elements, std::string const& n, std::string const& m) {
    return message_of([&] {
      parse_gmsh("$NOD\n" + n + "\n7 5 5 5\n10 0 0 0\n20 1 0 0\n30 0 1 0\n8 6 6 6\n40 0 0 1\n" + nodes + "$ENDNOD\n$ELM\n" + m + "\n1 2 1 1 3 10 20 30\n2 4 1 1 4 10 20 30 40\n" +
                 elements + "$ENDELM\n");
    });
  };
  std::string const order = "from 0 in the order of the file", second_is = "the vertices of tetrahedron 1 are ";
  auto const told = said("50 1 0 0\n60 1 1 1\n", "3 4 1 1 4 50 30 40 60\n", "8", "3");
  CHECK(unsaid(told, "vertex 6 lies on vertex 2", "Coherence Mesh", order) == "");
  CHECK(told.find("`repair`") == std::string::npos);
  CHECK(unsaid(said("50 .5 .5 0\n", "3 4 1 1 4 10 50 30 20\n", "7", "3"), "tetrahedron 1 has no volume", second_is + "1 (0, 0, 0), 6 (0.5, 0.5, 0), 3 (0, 1, 0), 2 (1, 0, 0)", order) == "");
  CHECK(unsaid(said("50 1e9 .5 0\n", "3 4 1 1 4 10 50 30 40\n", "7", "3"), second_is, "6 (1e+09, 0.5, 0)", "correct the vertex") == "");
  CHECK(unsaid(said("50 1e300 .5 0\n", "3 4 1 1 4 10 50 30 40\n", "7", "3"), second_is, "6 (1e+300, 0.5, 0)", "correct the vertex") == "");
  CHECK(unsaid(said("50 1 1 1\n", "3 4 1 1 4 40 50 30 40\n", "7", "3"), "tetrahedron 1 names vertex 5 more than once", "take it out", order) == "");
  CHECK(unsaid(said("", "3 4 1 1 4 40 30 20 10\n", "6", "3"), "tetrahedron 1 has the same corners as tetrahedron 0", second_is + "5, 3, 2, 1", "one group", order) == "");
  CHECK(unsaid(said("50 .3 .3 2\n", "3 4 1 1 4 20 10 30 50\n", "7", "3"), "tetrahedra 0 and 1 lie on the same side", second_is + "2, 1, 3, 6", order) == "");
  CHECK(unsaid(said("50 .3 .3 -2\n60 .3 .3 -1\n", "3 4 1 1 4 20 10 30 50\n4 4 1 1 4 20 10 30 60\n", "8", "4"), "3 tetrahedra", "the vertices of tetrahedron 0 are 1, 2, 3, 5", order) == "");
}

// Two cubes of six tetrahedra beside one another, the left one's written last; by hand after the reference manual, triangles between.
TEST_CASE("tetrahedra keep the order of a Gmsh file, and its physical groups name them", "[volume][gmsh]") {
  auto const row = make_block<double>(3, 2, 2, 1.0);
  std::vector<int> order, nodule, all{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};   // of the block's tetrahedra in the file
  for (bool const left : {false, true})
    for (int t = 0; t < 12; ++t) {
      double middle = 0;
      for (int const v : row.tetrahedra.col(t)) middle += row.points(0, v) / 4;
      if ((middle < 1) != left) continue;
      if (left) nodule.push_back(static_cast<int>(order.size()));
      order.push_back(t);
    }
  REQUIRE(nodule == std::vector<int>{6, 7, 8, 9, 10, 11});
  std::ostringstream nodes, tags, places, old, blocks;
  for (int v = 0; v < 12; ++v) {
    Vector3<double> const p = row.points.col(v);
    tags << 100 - v << '\n', places << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    nodes << 100 - v << ' ' << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  }
  for (int k = 0; k < 12; ++k) {
    auto const corners = [&](std::ostream& out) {
      for (int const v : row.tetrahedra.col(order[static_cast<std::size_t>(k)])) out << ' ' << 100 - v;
      out << '\n';
    };
    if (k == 6) old << "90 2 2 7 1 100 99 98\n", blocks << "3 8 4 6\n";
    old << k + 1 << (k < 6 ? " 4 2 3 1" : " 4 2 5 2"), corners(old);
    blocks << k + 1, corners(blocks);
  }
  std::string const names = "$PhysicalNames\n3\n2 3 \"skin\"\n3 3 \"liver, left \"\n3 5 \"$End \"nodule\"\"\n$EndPhysicalNames\n";
  std::string const second_text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + names + "$Nodes\n12\n" + nodes.str() + "$EndNodes\n$Elements\n13\n" + old.str() + "$EndElements\n";
  std::string const fourth_text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + names + "$Entities\n1 0 1 2\n1 0 0 0 1 9\n1 0 0 0 1 1 1 1 3 0\n4 0 0 0 1 1 1 1 3 0\n8 0 0 0 1 1 1 2 3 5 1 1\n$EndEntities\n" +
                                  "$Nodes\n1 12 89 100\n3 4 0 12\n" + tags.str() + places.str() + "$EndNodes\n$Elements\n3 13 1 90\n2 1 2 1\n90 100 99 98\n3 4 4 6\n" + blocks.str() +
                                  "$EndElements\n";
  for (auto const& text : {second_text, fourth_text}) {
    bool const of_entities = text == fourth_text;
    auto const mesh = parse_gmsh(text);
    REQUIRE(mesh.tetrahedra.cols() == 12);
    for (int k = 0; k < 12; ++k) CHECK(mesh.tetrahedra.col(k) == row.tetrahedra.col(order[static_cast<std::size_t>(k)]));
    auto const groups = parse_gmsh_groups(text);
    REQUIRE(groups.size() == 2);
    CHECK(groups[0].tag == 3);
    CHECK(groups[0].name == "liver, left ");
    CHECK(groups[0].tetrahedra == (of_entities ? all : std::vector<int>{0, 1, 2, 3, 4, 5}));   // a volume of version 4 may be in two
    CHECK(groups[1].tag == 5);
    CHECK(groups[1].name == "$End \"nodule\"");
    CHECK(groups[1].tetrahedra == nodule);
    FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1000.0, .material = {.young = 5e3, .poisson = 0.4}});
    tissue.set_material(groups[1].tetrahedra, {.young = 5e3, .poisson = 0.4}, 3000.0);
    double mass = 0, moment = 0;
    for (int i = 0; i < tissue.size(); ++i) mass += tissue.mass(i), moment += tissue.mass(i) * mesh.points(0, i);
    CHECK(mass == Approx(4000.0));            // 1 m³ of each
    CHECK(moment == Approx(3000.0));          // the left one's middle is at 0.5 m, the other's at 1.5 m
  }
  CHECK(parse_gmsh_groups(first).at(0).tag == 1);
  CHECK(parse_gmsh_groups(second).at(0).tetrahedra == std::vector<int>{0});   // the other one has no tags
  CHECK(parse_gmsh_groups(fourth).empty());
  // Volumes that are listed twice, groups that are, and those that Gmsh has turned over, of which it writes −tag.
  std::string const volume_8 = "8 0 0 0 1 1 1 2 3 5 1 1\n";
  for (auto const& text : {with(with(fourth_text, "1 0 1 2\n", "1 0 1 3\n"), volume_8, volume_8 + volume_8),
                           with(fourth_text, volume_8, "8 0 0 0 1 1 1 4 5 3 5 3 1 1\n"),
                           with(fourth_text, volume_8, "8 0 0 0 1 1 1 2 -3 -5 1 1\n")}) {
    auto const groups = parse_gmsh_groups(text);
    CHECK(groups.size() == 2);
    CHECK((groups.front().tag == 3 && groups.front().tetrahedra == all));
    CHECK((groups.back().tag == 5 && groups.back().tetrahedra == nodule));
  }
  std::string turned = second_text;
  for (std::size_t at; (at = turned.find(" 4 2 5 2")) != std::string::npos;) turned.replace(at, 8, " 4 2 -5 2");
  REQUIRE(parse_gmsh_groups(turned).size() == 2);
  CHECK((parse_gmsh_groups(turned)[1].tag == 5 && parse_gmsh_groups(turned)[1].tetrahedra == nodule));
  CHECK(parse_gmsh_groups(with(second, "3 4 2 1 1", "3 4 2 -9223372036854775808 1")).at(1).tag == 9223372036854775807);
  CHECK(unsaid(message_of([&] { parse_gmsh_groups(with(fourth_text, "8 0 0 0 1 1 1 2 3 5 1 1", "7 0 0 0 1 1 1 2 3 5 1 1")); }), "line", "volume 8", "$Entities") == "");
  CHECK(unsaid(message_of([&] { parse_gmsh_groups(with(fourth_text, "8 0 0 0 1 1 1 2 3 5 1 1", "8 0 0 0 1 1 1 2 3")); }), "line", "the tag of a physical group") == "");
  CHECK(unsaid(message_of([&] { parse_gmsh_groups(with(second_text, "3 3 \"liver, left \"", "3 3 \"liver")); }), "line", "group 3", "quotes") == "");
  ScratchFolder const folder;
  CHECK(read_gmsh_groups(folder.write("organ.msh", second_text)).size() == 2);
  CHECK_THROWS_AS(read_gmsh_groups(folder.path() / "none.msh"), FileError);
}

// A whole person, a room for tests and a vessel are read; an organ in millimetres that is taken for metres is not.
TEST_CASE("a Gmsh file whose unit nobody stated is refused where metres make no sense", "[volume][gmsh]") {
  auto const of_length = [](std::string const& length) {
    return "$NOD\n5\n1 0 0 0\n2 " + length + " 0 0\n3 0 " + length + " 0\n4 0 0 " + length + "\n5 9e9 0 0\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n";
  };
  for (std::string const length : {"1e-5", "0.001", "1", "2", "10"}) CHECK(parse_gmsh(of_length(length)).points(0, 1) == std::stod(length));
  CHECK_THROWS_AS(parse_gmsh(of_length("163")), FileError);
  CHECK(unsaid(message_of([&] { parse_gmsh(of_length("163"), {}, "organ.msh"); }), "organ.msh: read in metres, the longest side would be 163 m", "in mm it would be 0.163 m",
               "metres_per_unit, as metres_per(\"mm\")") == "");
  CHECK(parse_gmsh(of_length("163"), metres_per("mm")).points(0, 1) == Approx(0.163));
  CHECK(parse_gmsh(of_length("163"), metres_per("m")).points(0, 1) == 163);
  CHECK(parse_gmsh<float>(of_length("0.16"), metres_per("mm")).points(0, 1) == Approx(0.00016f));
}

// Yardstick: the exact volume of the octahedron. Its middle vertex has gone through a face: what the reader turned would count twice.
TEST_CASE("a Gmsh file that is folded is refused, as it is by a tissue", "[volume][gmsh]") {
  auto const octahedron = [](char const* middle) {
    std::string text = "$NOD\n7\n1 1 0 0\n2 -1 0 0\n3 0 1 0\n4 0 -1 0\n5 0 0 1\n6 0 0 -1\n7 ";
    text += std::string(middle) + "\n$ENDNOD\n$ELM\n8\n";
    for (int i = 0; i < 8; ++i)
      text += std::to_string(i + 1) + " 4 1 1 4 " + std::to_string(1 + i % 2) + " " + std::to_string(3 + i / 2 % 2) + " " + std::to_string(5 + i / 4) + " 7\n";
    return text + "$ENDELM\n";
  };
  CHECK(volume(parse_gmsh(octahedron("0.1 0.2 0.05"))) == Approx(4.0 / 3).epsilon(1e-12));
  CHECK(unsaid(message_of([&] { parse_gmsh(octahedron("0.9 0.8 0.6")); }), "on the same side", "overlap") == "");
}

// 10⁵ before an issue closes; see CONTRIBUTING.md.
TEST_CASE("damaged Gmsh files are read or refused, never crash", "[volume][gmsh][fuzz]") {
  char const* const wanted = std::getenv("PALPATE_GMSH_FILES");
  int const rounds = wanted != nullptr ? std::atoi(wanted) : 2000;
  std::mt19937_64 random(7);
  int read = 0, refused = 0;
  for (int round = 0; round < rounds; ++round) {
    std::string text = round % 3 == 0 ? first : round % 3 == 1 ? second : fourth;
    for (std::uint64_t edits = 1 + random() % 3; edits > 0; --edits) {
      std::size_t const at = random() % text.size(), length = random() % 9;
      switch (random() % 4) {
        case 0: text[at] = static_cast<char>(random() % 256); break;
        case 1: text.erase(at, length); break;
        case 2: text.insert(at, text.substr(random() % text.size(), length)); break;
        default: text.insert(at, std::to_string(static_cast<long long>(random() >> (random() % 60)))); break;
      }
      if (text.empty()) text = "$";
    }
    try {
      auto const mesh = parse_gmsh(text, 1.0);
      if (!validate(mesh).empty()) FAIL("an invalid mesh was read from:\n" << text);
      try {
        for (auto const& group : parse_gmsh_groups(text))
          for (int const t : group.tetrahedra)
            if (t < 0 || t >= mesh.tetrahedra.cols()) FAIL("a group of no tetrahedron was read from:\n" << text);
      } catch (FileError const&) {
      }
      ++read;
    } catch (FileError const&) {
      ++refused;
    }
  }
  CHECK(read + refused == rounds);
  CHECK(read > rounds / 100);
  CHECK(refused > rounds / 10);
}
