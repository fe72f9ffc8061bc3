// SPDX-License-Identifier: MIT
#include <palpate/core/random.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/json/network_file.hpp>

#include "catch.hpp"
#include "replaced.hpp"
#include "scratch_folder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <clocale>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

using Small = Network<double, 1, 2, 1>;
using Liver = NetworkCurve<Network<double, 2, 5, 1>>;

/// Any finite double: any bits.
double any_double(Random& random) {
  for (;;)
    if (double const value = std::bit_cast<double>(random()); std::isfinite(value)) return value;
}

/// A small network whose file is short enough to be written down.
Small small_network() {
  Small::Layers layers;
  std::get<0>(layers).weights = {{{0.1}, {-2.0}}};
  std::get<0>(layers).bias = {1.0 / 3.0, 0.0};
  std::get<1>(layers).weights = {{{1e-300, 5e-324}}};
  std::get<1>(layers).bias = {-0.0};
  return Small(layers, {.input_offset = {0.01}, .input_gain = {1000.0}, .output_offset = {0.0}, .output_gain = {0.5}});
}

std::string const small_text = R"({
  "format": "palpate network",
  "version": 1,
  "activation": "tanh",
  "sizes": [1, 2, 1],
  "scaling": {
    "input_offset": [0.01],
    "input_gain": [1000.0],
    "output_offset": [0.0],
    "output_gain": [0.5]
  },
  "layers": [
    {
      "weights": [
        [0.1],
        [-2.0]
      ],
      "bias": [0.3333333333333333, 0.0]
    },
    {
      "weights": [
        [1e-300, 5e-324]
      ],
      "bias": [-0.0]
    }
  ]
}
)";

template <class A, class B>
bool same_bits(A const& a, B const& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) {
           return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
         });
}

template <class T>
std::string error_of(std::string const& text) {
  try {
    parse_network<T>(text, "net.json");
  } catch (FileError const& error) {
    return error.what();
  }
  return "";
}

}  // namespace

// Yardstick: the file typed in by hand.
TEST_CASE("a network's file is the documented text, to the byte") {
  CHECK(network_text(small_network()) == small_text);
  Small const again = parse_network<Small>(small_text);
  CHECK(same_bits(again.parameters(), small_network().parameters()));
  CHECK(std::signbit(again.parameters().back()));
  CHECK(again.scaling().input_offset == std::array<double, 1>{0.01});
  CHECK(again.scaling().input_gain == std::array<double, 1>{1000.0});
  CHECK(again.scaling().output_gain == std::array<double, 1>{0.5});
  CHECK(again.has_scaling());
  CHECK(network_text(again) == small_text);

  Small const raw(Seed{1});
  CHECK(network_text(raw).find("\n  \"scaling\": null,\n") != std::string::npos);
  CHECK_FALSE(parse_network<Small>(network_text(raw)).has_scaling());
}

// Yardstick: any bits that are a finite number, compared as bits.
TEST_CASE("every number reads back to the same bits") {
  Random random(Seed{1});
  for (int round = 0; round < 300; ++round) {
    using Net = BasicNetwork<HalfSigmoid, double, 2, 3, 2, 2>;
    Net net;
    Net::Parameters parameters{};
    for (double& value : parameters) value = any_double(random);
    net.set_parameters(parameters);
    Net::Scaling scaling;
    for (auto* list : {&scaling.input_offset, &scaling.input_gain, &scaling.output_offset, &scaling.output_gain})
      for (double& value : *list) value = any_double(random);
    net.set_scaling(scaling);
    std::string const text = network_text(net);
    Net const again = parse_network<Net>(text);
    REQUIRE(same_bits(again.parameters(), parameters));
    REQUIRE(same_bits(again.scaling().input_offset, scaling.input_offset));
    REQUIRE(same_bits(again.scaling().input_gain, scaling.input_gain));
    REQUIRE(same_bits(again.scaling().output_offset, scaling.output_offset));
    REQUIRE(same_bits(again.scaling().output_gain, scaling.output_gain));
    REQUIRE(network_text(again) == text);
  }
}

TEST_CASE("a locale with decimal commas changes no network file") {
  std::string const before = std::setlocale(LC_ALL, nullptr);
  for (char const* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    CHECK(network_text(small_network()) == small_text);
    CHECK(same_bits(parse_network<Small>(small_text).parameters(), small_network().parameters()));
  }
  std::setlocale(LC_ALL, before.c_str());
}

TEMPLATE_TEST_CASE("a curve comes back from its file with its range and its cap", "", float, double) {
  using S = TestType;
  ScratchFolder const folder;
  auto const curve = liver_hysteresis<S>({.largest_force = S(3)});
  using Curve = std::remove_cvref_t<decltype(curve)>;
  auto const file = folder.path() / "liver.json";
  write_network(file, curve);
  auto const again = read_network<Curve>(file);
  for (S depth : {S(-0.01), S(0), S(0.015), S(0.02283), S(0.024), S(0.1)})
    for (Phase const phase : {Phase::loading, Phase::unloading}) CHECK(again(depth, phase) == curve(depth, phase));
  CHECK(again.range().high == curve.range().high);
  CHECK(again.guard().largest_force == S(3));
  std::string const bytes = ScratchFolder::read(file);
  CHECK(bytes == network_text(curve));
  write_network(file, again);
  CHECK(ScratchFolder::read(file) == bytes);

  // Its network alone, and in the other scalar.
  auto const network = read_network<Network<S, 2, 5, 1>>(file);
  CHECK(network.parameters() == curve.network().parameters());
  using Other = std::conditional_t<std::is_same_v<S, double>, float, double>;
  auto const other = read_network<Network<Other, 2, 5, 1>>(file);
  for (std::size_t k = 0; k < network.parameters().size(); ++k) CHECK(other.parameters()[k] == static_cast<Other>(network.parameters()[k]));

  auto const free = liver_loading<S>(CurveGuard<S>{});
  CHECK(std::isinf(parse_network<std::remove_cvref_t<decltype(free)>>(network_text(free)).guard().largest_force));
}

TEST_CASE("a malformed network file is refused with what, where and what to do") {
  struct Case {
    std::string what, by, error;
  };
  Case const cases[] = {
      {"0.5]", "0.5", "net.json, line 11, column 3, near /scaling/output_gain/1: this is no JSON: syntax error while parsing array - "
                      "unexpected '}'; expected ']'; give a file that palpate wrote"},
      {"-2.0", "NaN", "net.json, line 16, column 10, near /layers/0/weights/1/0: this is no JSON: syntax error while parsing value - invalid "
                      "literal; last read: '0.1],<U+000A>        [N'; give a file that palpate wrote"},
      {"-2.0", "1e999", "net.json, near /layers/0/weights/1/0: number overflow parsing '1e999'; give numbers that a double can hold"},
      {"-2.0", "\"two\"", "net.json: /layers/0/weights/1/0 is \"two\"; give a number"},
      {"-2.0", "null", "net.json: /layers/0/weights/1/0 is null; give a number"},
      {"-2.0", "-2.0, 1.0", "net.json: /layers/0/weights/1 has 2 entries; give 1"},
      {"[-2.0]", "-2.0", "net.json: /layers/0/weights/1 is -2.0; give a list of 1"},
      {", 0.0]", "]", "net.json: /layers/0/bias has 1 entries; give 2"},
      {"palpate network", "palpate nets", "net.json: /format is \"palpate nets\"; give a file of the format \"palpate network\""},
      {"\"version\": 1", "\"version\": 2",
       "net.json: /version is 2, this palpate reads version 1; write the file again, or read it with the palpate that wrote it"},
      {"\"version\": 1", "\"version\": \"1\"",
       "net.json: /version is \"1\", this palpate reads version 1; write the file again, or read it with the palpate that wrote it"},
      {"\"tanh\"", "\"half_sigmoid\"", "net.json: /activation is \"half_sigmoid\", that of the network asked for is \"tanh\"; ask for a "
                                       "BasicNetwork with the file's activation"},
      {"[1, 2, 1]", "[1, 5, 1]", "net.json: /sizes is [1,5,1], the network asked for is 1-2-1; ask for a network of the file's sizes"},
      {"[1, 2, 1]", "[1, 2]", "net.json: /sizes is [1,2], the network asked for is 1-2-1; ask for a network of the file's sizes"},
      {"1000.0", "0", "net.json: /scaling/input_gain/0 is 0; give a gain other than zero"},
      {"\"output_gain\"", "\"output_gian\"", "net.json: /scaling has a key \"output_gian\" that means nothing here; remove it, the keys are "
                                             "input_offset, input_gain, output_offset, output_gain"},
      {"    \"input_offset\": [0.01],\n", "", "net.json: /scaling has no key \"input_offset\"; add it"},
      {"\"bias\": [0.3", "\"weights\": [0.3", "net.json: the key /layers/0/weights is there twice; remove one of them"},
      {"  \"version\": 1,\n", "  \"version\": 1,\n  \"author\": \"me\",\n",
       "net.json: the document has a key \"author\" that means nothing here; remove it, the keys are format, version, activation, sizes, "
       "scaling, layers, curve"},
      {"  \"version\": 1,\n", "  \"version\": 1,\n  \"curve\": 5,\n", "net.json: /curve is 5; give an object, { ... }"},
      {"\"tanh\"", "\"t\xff\"", "net.json, line 4, column 19, near /activation: this is no JSON: syntax error while parsing value - invalid "
                                "string: ill-formed UTF-8 byte; last read: '\"t?'; give a file that palpate wrote"},
  };
  for (Case const& c : cases) CHECK(error_of<Small>(replaced(small_text, c.what, c.by)) == c.error);
  CHECK_THAT(error_of<Small>(""), says("net.json, line 1, column 1", "no JSON", "a file that palpate wrote"));
  CHECK_THAT(error_of<Small>("[1]"), says("net.json", "[1]", "an object, { ... }"));
  CHECK_THAT(error_of<Small>("{}"), says("net.json", "no key \"format\"", "add it"));
  CHECK(std::count(small_text.begin(), small_text.end(), '\n') == 27);
  CHECK(error_of<Small>(small_text + "{}").find("net.json, line 28, column 1: ") == 0);
  CHECK_THAT(error_of<NetworkCurve<Small>>(small_text), says("net.json", "no key \"curve\"", "add it"));
  CHECK_THAT((error_of<Network<float, 1, 2, 1>>(replaced(small_text, "-2.0", "-2e39"))), says("net.json", "/layers/0/weights/1/0 is -2e+39", "3.40282347e+38"));
  CHECK_THAT((error_of<BasicNetwork<HalfSigmoid, double, 1, 2, 1>>(small_text)), says("net.json", "/activation is \"tanh\"", "\"half_sigmoid\"", "BasicNetwork"));

  std::string const curve = network_text(liver_hysteresis<double>(CurveGuard<double>{}));
  CHECK_THAT(error_of<Liver>(replaced(curve, "0.02283]", "-1]")), says("net.json", "/curve", "0 … -1 m", "the lower one first"));
  CHECK_THAT(error_of<Liver>(replaced(curve, "0.02283]", "0.02283, 1]")), says("net.json", "/curve/depth_range_m", "3 entries", "give 2"));
  CHECK_THAT(error_of<Liver>(replaced(curve, "\"largest_force_N\": null", "\"largest_force_N\": 1")), says("net.json", "/curve", ".largest_force is 1 N", "1.38230342 N", "no less"));
  CHECK_THAT(error_of<Liver>(replaced(curve, ",\n    \"largest_force_N\": null", "")), says("net.json", "/curve has no key \"largest_force_N\"", "add it"));
}

TEST_CASE("a file that is not there or can not be written says so, and an older one stays") {
  ScratchFolder const folder;
  auto const file = folder.path() / "net.json";
  CHECK_THROWS_WITH(read_network<Small>(file), says(file.string(), "does not exist", "check the path"));
  CHECK_THROWS_WITH(read_network<Small>(folder.path()), says(folder.path().string(), "a folder", "give a file"));
  write_network(file, small_network());
  CHECK(network_text(read_network<Small>(file)) == small_text);
  CHECK_THROWS_AS(write_network(folder.path() / "no" / "net.json", small_network()), FileError);
  CHECK_THROWS_AS(write_network(folder.path(), small_network()), FileError);
  CHECK(ScratchFolder::read(file) == small_text);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

// Nothing that a disk or a hand does to a file crashes: it reads as a network whose numbers are finite, or is refused in one legible line.
TEST_CASE("damaged network files are networks or refused") {
  int read = 0, refused = 0;
  auto const check = [&](auto const& good, std::string const& text) {
    using T = std::remove_cvref_t<decltype(good)>;
    try {
      T const network = parse_network<T>(text, "net.json");
      ++read;
      REQUIRE(network_text(parse_network<T>(network_text(network))) == network_text(network));
    } catch (FileError const& error) {
      ++refused;
      std::string const what = error.what();
      REQUIRE(what.find("net.json") == 0);
      REQUIRE(what.size() < 500);
      REQUIRE(std::none_of(what.begin(), what.end(), [](char c) { return c == '\n' || c == '\0'; }));
    }
  };
  auto const damage = [&](auto const& good, std::uint64_t seed) {
    std::string const text = network_text(good);
    for (std::size_t length = 0; length <= text.size(); ++length) check(good, text.substr(0, length));
    CHECK(read == 2);   // whole, and without its last end of line
    Random random(Seed{seed});
    static std::string const likely = "0123456789-+.eE,:[]{}\" \n\\tfnul";
    for (int round = 0; round < 4000; ++round) {
      std::string changed = text;
      auto const below = [&](std::size_t count) { return static_cast<std::size_t>(random.below(count)); };
      for (std::size_t changes = 1 + below(3); changes > 0; --changes) {
        std::size_t const at = below(changed.size()), kind = below(4), from = below(changed.size()), count = below(20);
        char const byte = below(2) == 0 ? static_cast<char>(below(256)) : likely[below(likely.size())];
        if (kind == 0)
          changed.erase(at, 1 + count / 2);
        else if (kind == 1)
          changed.insert(at, 1, byte);
        else if (kind == 2)
          changed.insert(at, changed.substr(from, count));
        else
          changed[at] = byte;
      }
      check(good, changed);
    }
    CAPTURE(read, refused);
    CHECK(read > 50);
    CHECK(refused > 1000);
    read = refused = 0;
  };
  damage(small_network(), 1);
  damage(liver_hysteresis<double>({.largest_force = 2.0}), 2);
  damage(liver_loading<float>(), 3);
}
