// SPDX-License-Identifier: MIT
// Pictures in parts, and what becomes of parts that make none.
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/network/picture_messages.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

using namespace palpate;

namespace {

using Bytes = std::vector<std::byte>;

BodySnapshot<double> picture(int points, int triangles, std::size_t revision) {
  Random random(Seed{7});
  BodySnapshot<double> made;
  made.topology_revision = revision;
  made.points.resize(3, points);
  for (double& x : made.points.reshaped()) x = random.uniform<double>();
  made.triangles.resize(3, triangles);
  for (int& corner : made.triangles.reshaped()) corner = static_cast<int>(random.uniform<double>() * points);
  for (int t = 0; t < triangles; ++t) made.is_wound.push_back(t % 3 == 0 ? 1 : 0);
  return made;
}
Drawn drawn_of(BodySnapshot<double> const& of) {
  return {.time = 1.5, .revision = of.topology_revision, .points = static_cast<std::uint32_t>(of.points.cols()),
          .triangles = static_cast<std::uint32_t>(of.triangles.cols()), .has_hand = true, .tip = {0.1, 0.2, 0.3}};
}
/// The frames one after the other, as a stream gives them.
std::vector<Bytes> frames_of(Bytes const& bytes) {
  std::vector<Bytes> frames;
  FrameStream stream;
  for (std::size_t done = 0; done < bytes.size();) {
    auto const room = stream.room();
    std::size_t const count = std::min(room.size(), bytes.size() - done);
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(done), count, room.begin());
    stream.filled(count), done += count;
    while (auto const frame = stream.next()) frames.emplace_back(frame->body.begin(), frame->body.end());
  }
  CHECK(stream.problem() == ProtocolProblem::none);
  return frames;
}
ProtocolProblem take(PictureAssembly& assembly, MessageType type, Bytes const& body) {
  Frame const frame{type, body};
  return type == MessageType::points ? assembly.take_points(frame) : assembly.take_triangles(frame);
}
template <class Integer>
Bytes with(Bytes body, std::size_t place, Integer value) {
  detail::network::put(body.data() + place, value);
  return body;
}

}  // namespace

TEST_CASE("a picture is the same after its parts were put together", "[network]") {
  auto const [points, triangles] = GENERATE(std::pair(3, 1), std::pair(20000, 30000), std::pair(0, 0), std::pair(5, 0));
  auto const sent = picture(points, triangles, 42);
  Bytes triangle_bytes, point_bytes;
  append_triangles(triangle_bytes, sent);
  REQUIRE(append_points(point_bytes, sent));
  PictureAssembly assembly;
  CHECK(assembly.check(drawn_of(sent)) == ProtocolProblem::order);   // nothing came
  for (Bytes const& body : frames_of(triangle_bytes)) REQUIRE(take(assembly, MessageType::triangles, body) == ProtocolProblem::none);
  CHECK(assembly.check(drawn_of(sent)) == ProtocolProblem::order);   // no points came
  for (Bytes const& body : frames_of(point_bytes)) REQUIRE(take(assembly, MessageType::points, body) == ProtocolProblem::none);
  REQUIRE(assembly.check(drawn_of(sent)) == ProtocolProblem::none);
  BodySnapshot<float> seen;
  assembly.draw(drawn_of(sent), seen);
  CHECK(seen.triangles == sent.triangles);
  CHECK(seen.points == sent.points.cast<float>());
  CHECK(seen.is_wound == sent.is_wound);
  CHECK(seen.time == 1.5);
  REQUIRE(seen.tools.size() == 1);
  CHECK(seen.tip == Vector3<float>(0.1f, 0.2f, 0.3f));
}

TEST_CASE("parts that make no picture are refused", "[network]") {
  auto const sent = picture(6000, 6000, 3);   // two parts each
  Bytes bytes;
  append_triangles(bytes, sent);
  auto const triangles = frames_of(bytes);
  bytes.clear();
  append_points(bytes, sent);
  auto const points = frames_of(bytes);
  REQUIRE(triangles.size() == 2);
  REQUIRE(points.size() == 2);
  PictureAssembly assembly;
  auto const refused = [&](MessageType type, Bytes const& body) { return take(assembly, type, body); };

  CHECK(refused(MessageType::points, points[1]) == ProtocolProblem::order);            // the second part first
  CHECK(refused(MessageType::points, Bytes(19)) == ProtocolProblem::size);
  CHECK(refused(MessageType::points, with(points[0], 16, std::uint32_t{5000})) == ProtocolProblem::size);     // a count that is not that of its bytes
  CHECK(refused(MessageType::points, with(points[0], 8, (1u << 22) + 1)) == ProtocolProblem::number);         // more than any picture has
  CHECK(refused(MessageType::points, with(points[0], 8, std::uint32_t{100})) == ProtocolProblem::number);     // a part beyond the whole
  CHECK(refused(MessageType::points, with(points[0], 12, 0xffffffffu)) == ProtocolProblem::number);
  CHECK(refused(MessageType::points, with(points[0], 20, std::bit_cast<std::uint32_t>(std::numeric_limits<float>::quiet_NaN()))) == ProtocolProblem::number);
  CHECK(refused(MessageType::points, with(points[0], 20, std::bit_cast<std::uint32_t>(1e9f))) == ProtocolProblem::number);
  CHECK(refused(MessageType::triangles, with(triangles[0], 32, std::uint8_t{2})) == ProtocolProblem::number);  // neither a wound nor none
  Bytes nothing(20);
  CHECK(refused(MessageType::points, with(nothing, 8, std::uint32_t{7})) == ProtocolProblem::number);          // a part without columns

  CHECK(refused(MessageType::points, points[0]) == ProtocolProblem::none);
  CHECK(refused(MessageType::points, with(points[1], 0, std::uint64_t{4})) == ProtocolProblem::order);         // of another revision
  CHECK(refused(MessageType::points, points[1]) == ProtocolProblem::none);
  CHECK(refused(MessageType::points, points[1]) == ProtocolProblem::order);                                    // twice
  CHECK(refused(MessageType::triangles, triangles[0]) == ProtocolProblem::none);
  CHECK(assembly.check(drawn_of(sent)) == ProtocolProblem::order);                                             // half a picture
  CHECK(refused(MessageType::triangles, with(triangles[1], 20, std::uint32_t{6000})) == ProtocolProblem::none);
  CHECK(assembly.check(drawn_of(sent)) == ProtocolProblem::number);                                            // a corner that is no point
  for (Bytes const& body : triangles) CHECK(refused(MessageType::triangles, body) == ProtocolProblem::none);
  CHECK(assembly.check(drawn_of(sent)) == ProtocolProblem::none);
  Drawn other = drawn_of(sent);
  other.revision = 4;
  CHECK(assembly.check(other) == ProtocolProblem::order);
  assembly.reset();
  CHECK(assembly.check(drawn_of(sent)) == ProtocolProblem::order);

  auto flies_away = sent;
  flies_away.points(1, 77) = std::numeric_limits<double>::infinity();
  CHECK_FALSE(append_points(bytes, flies_away));
}
