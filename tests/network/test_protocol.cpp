// SPDX-License-Identifier: MIT
// The protocol's bytes, and what becomes of bytes that are not as they must be.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/network/remote_tissue.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

using namespace palpate;

namespace {

using Bytes = std::vector<std::byte>;

template <class M>
Bytes bytes_of(M const& message) {
  std::array<std::byte, max_fixed_frame> frame;
  std::size_t const size = encode(message, frame);
  return {frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size)};
}
std::string hex(Bytes const& bytes) {
  std::string text;
  for (std::byte const b : bytes) {
    constexpr std::string_view digits = "0123456789abcdef";
    text += digits[static_cast<std::size_t>(b) >> 4];
    text += digits[static_cast<std::size_t>(b) & 15u];
  }
  return text;
}
void give(FrameStream& stream, std::span<std::byte const> bytes) {
  auto const room = stream.room();
  REQUIRE(bytes.size() <= room.size());
  std::copy(bytes.begin(), bytes.end(), room.begin());
  stream.filled(bytes.size());
}
template <class M>
M there_and_back(M const& message) {
  FrameStream stream;
  give(stream, bytes_of(message));
  auto const frame = stream.next();
  REQUIRE(frame);
  ProtocolProblem problem{};
  auto const again = decode<M>(*frame, problem);
  REQUIRE(again);
  return *again;
}
template <class M>
ProtocolProblem refused(M const& message) {
  FrameStream stream;
  give(stream, bytes_of(message));
  ProtocolProblem problem{};
  CHECK_FALSE(decode<M>(stream.next().value(), problem));
  return problem;
}

AnswerStamp a_stamp() { return {.sequence = 9, .hand = 7, .hand_time = 1.5, .pose_discontinuities = 2, .revision = 3, .time = 4.5}; }
HandReport a_hand() {
  return {.sequence = 7, .time = 1.5, .pose_discontinuities = 2, .position = {0.01, -0.02, 0.03}, .velocity = {0.1, 0.2, -0.3}, .opening = 0.25};
}
SurfaceAnswer a_surface() {
  SurfaceAnswer answer{.stamp = a_stamp()};
  answer.patch = {.point = {0.01, 0.02, 0.03}, .curvature = -20.0, .stiffness = 500.0, .velocity = {0.001, 0, 0}, .angular_velocity = {0, 0.5, 0}, .reach = 0.25};
  return answer;
}
TissueAnswer a_tissue() {
  return {.stamp = a_stamp(), .phase = CuttingPhase::indenting, .restorations = 5, .home_point = {0.01, 0.02, 0}, .tip_radius = 0.002, .force = {0, 0.1, 1.2},
          .moment = {0.001, 0, 0}, .cut_area = 1e-5};
}

}  // namespace

// Yardstick: the same fields packed by Python's struct module, format "<", in the order that docs/network.md says.
TEST_CASE("messages are these bytes on every machine", "[network]") {
  CHECK(hex(bytes_of(Hello{.role = ClientRole::onlooker, .rate = 1000.0})) == "50414c50010100000b0000000101020000000000408f40");
  CHECK(hex(bytes_of(Welcome{.session = 0x0123456789abcdefu, .contact_stiffness = 2000.0, .revision = 3})) ==
        "50414c50010200002900000001efcdab896745230100000000000059400000000000407f400000000000409f400300000000000000");
  CHECK(hex(bytes_of(a_hand())) ==
        "50414c5001040000700000000700000000000000000000000000f83f02000000000000007b14ae47e17a843f7b14ae47e17a94bfb81e85eb51b89e3f9a9999999999b93f9a9999999999c93f"
        "333333333333d3bf000000000000000000000000000000000000000000000000000000000000f03f000000000000d03f");
  CHECK(hex(bytes_of(a_surface())) ==
        "50414c5001050000a800000009000000000000000700000000000000000000000000f83f0200000000000000030000000000000000000000000012407b14ae47e17a843f7b14ae47e17a943fb8"
        "1e85eb51b89e3f00000000000000000000000000000000000000000000f03f00000000000034c00000000000407f40fca9f1d24d62503f0000000000000000000000000000000000000000000"
        "00000000000000000e03f0000000000000000000000000000d03f");
  CHECK(hex(bytes_of(a_tissue())) ==
        "50414c5001060000aa00000009000000000000000700000000000000000000000000f83f020000000000000003000000000000000000000000001240010005000000000000007b14ae47e17a843f"
        "7b14ae47e17a943f000000000000000000000000000000000000000000000000000000000000f03ffca9f1d24d62603f00000000000000009a9999999999b93f333333333333f33ffca9f1d24d"
        "62503f00000000000000000000000000000000f168e388b5f8e43e");
  CHECK(hex(bytes_of(KeepAlive{.time = 1.5, .echo = 0.5, .held = 0.25})) == "50414c500107000018000000000000000000f83f000000000000e03f000000000000d03f");
}

TEST_CASE("what is encoded comes back to the bit", "[network]") {
  HandReport const hand = there_and_back(a_hand());
  CHECK(hand.position == a_hand().position);
  CHECK(hand.velocity == a_hand().velocity);
  CHECK(hand.opening == 0.25);
  CHECK(there_and_back(a_surface()).patch == a_surface().patch);
  TissueAnswer const tissue = there_and_back(a_tissue());
  CHECK(tissue.force == a_tissue().force);
  CHECK(tissue.phase == CuttingPhase::indenting);
  CHECK(tissue.restorations == 5);
  SurfaceAnswer endless = a_surface();
  endless.patch.reach = std::numeric_limits<double>::infinity();   // a plane that stands for all of the surface
  CHECK(std::isinf(there_and_back(endless).patch.reach));
}

TEST_CASE("a stream is cut into the same frames however its bytes come", "[network]") {
  Bytes all;
  for (int k = 0; k < 40; ++k)
    for (Bytes const& one : {bytes_of(a_hand()), bytes_of(KeepAlive{}), bytes_of(a_tissue())}) all.insert(all.end(), one.begin(), one.end());
  Random random(Seed{3});
  for (int run = 0; run < 20; ++run) {
    FrameStream stream;
    int frames = 0;
    for (std::size_t at = 0; at < all.size();) {
      std::size_t const size = std::min<std::size_t>(all.size() - at, 1 + random() % 300);
      give(stream, std::span(all).subspan(at, size));
      at += size;
      while (auto const frame = stream.next()) {
        CHECK(frame->type == std::array{MessageType::hand, MessageType::keep_alive, MessageType::tissue}[static_cast<std::size_t>(frames % 3)]);
        ++frames;
      }
    }
    CHECK(frames == 120);
    CHECK(stream.problem() == ProtocolProblem::none);
  }
}

TEST_CASE("the largest frame fits, one byte more is refused before it comes", "[network]") {
  FrameStream stream;
  Bytes frame(FrameFormat::header + FrameFormat::max_body);
  detail::network::put_header(frame.data(), MessageType::points, FrameFormat::max_body);
  give(stream, frame);
  CHECK(stream.next().value().body.size() == FrameFormat::max_body);
  CHECK(stream.room().size() == frame.size());
  detail::network::put_header(frame.data(), MessageType::points, FrameFormat::max_body + 1);
  give(stream, std::span(frame).first(FrameFormat::header));
  CHECK_FALSE(stream.next());
  CHECK(stream.problem() == ProtocolProblem::size);
}

TEST_CASE("C5-N3: every byte of a header is checked, as soon as it is there", "[network]") {
  struct Row {
    std::size_t at;
    std::uint8_t value;
    ProtocolProblem problem;
  };
  for (Row const& row : {Row{0, 'G', ProtocolProblem::no_palpate}, Row{3, 'p', ProtocolProblem::no_palpate}, Row{4, 0, ProtocolProblem::version}, Row{4, 2, ProtocolProblem::version},
                         Row{5, 0, ProtocolProblem::type}, Row{5, 12, ProtocolProblem::type}, Row{6, 1, ProtocolProblem::size}, Row{7, 1, ProtocolProblem::size},
                         Row{11, 1, ProtocolProblem::size}}) {
    INFO("byte " << row.at << " is " << int(row.value));
    Bytes bytes = bytes_of(a_hand());
    bytes[row.at] = std::byte{row.value};
    FrameStream stream;
    give(stream, std::span(bytes).first(std::max<std::size_t>(row.at + 1, row.at > 4 ? FrameFormat::header : 0)));
    CHECK_FALSE(stream.next());
    CHECK(stream.problem() == row.problem);
    give(stream, bytes_of(a_hand()));   // nothing after it is believed
    CHECK_FALSE(stream.next());
  }
}

TEST_CASE("C5-N3: a frame that is cut short gives nothing, and is no fault before its bytes are there", "[network]") {
  Bytes const bytes = bytes_of(a_tissue());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    FrameStream stream;
    give(stream, std::span(bytes).first(size));
    CHECK_FALSE(stream.next());
    CHECK(stream.problem() == ProtocolProblem::none);
  }
}

TEST_CASE("C5-N3: a message of another size or with a number that makes no sense is refused", "[network]") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  auto const hand = [](auto const& change) {
    HandReport report = a_hand();
    change(report);
    return refused(report);
  };
  auto const surface = [](auto const& change) {
    SurfaceAnswer answer = a_surface();
    change(answer.patch);
    return refused(answer);
  };
  auto const tissue = [](auto const& change) {
    TissueAnswer answer = a_tissue();
    change(answer);
    return refused(answer);
  };
  for (double const bad : {nan, infinite, -infinite, 1e300}) {
    INFO("with " << bad);
    CHECK(hand([&](auto& m) { m.position.y() = bad; }) == ProtocolProblem::number);
    CHECK(hand([&](auto& m) { m.velocity.z() = bad; }) == ProtocolProblem::number);
    CHECK(hand([&](auto& m) { m.time = bad; }) == ProtocolProblem::number);
    CHECK(hand([&](auto& m) { m.orientation.w() = bad; }) == ProtocolProblem::number);
    CHECK(surface([&](auto& m) { m.point.x() = bad; }) == ProtocolProblem::number);
    CHECK(surface([&](auto& m) { m.normal.x() = bad; }) == ProtocolProblem::number);
    CHECK(surface([&](auto& m) { m.curvature = bad; }) == ProtocolProblem::number);
    CHECK(surface([&](auto& m) { m.stiffness = bad; }) == ProtocolProblem::number);
    CHECK(surface([&](auto& m) { m.angular_velocity.x() = bad; }) == ProtocolProblem::number);
    CHECK(tissue([&](auto& m) { m.force.z() = bad; }) == ProtocolProblem::number);
    CHECK(tissue([&](auto& m) { m.home_point.z() = bad; }) == ProtocolProblem::number);
    CHECK(tissue([&](auto& m) { m.cut_area = bad; }) == ProtocolProblem::number);
    CHECK(tissue([&](auto& m) { m.stamp.hand_time = bad; }) == ProtocolProblem::number);
  }
  CHECK(hand([](auto& m) { m.sequence = 0; }) == ProtocolProblem::number);
  CHECK(hand([](auto& m) { m.opening = 1.5; }) == ProtocolProblem::number);
  CHECK(hand([](auto& m) { m.orientation.coeffs().setZero(); }) == ProtocolProblem::number);
  CHECK(surface([](auto& m) { m.normal *= 1.1; }) == ProtocolProblem::number);
  CHECK(surface([](auto& m) { m.stiffness = -1.0; }) == ProtocolProblem::number);
  CHECK(surface([](auto& m) { m.reach = nan; }) == ProtocolProblem::number);
  CHECK(tissue([](auto& m) { m.phase = static_cast<CuttingPhase>(3); }) == ProtocolProblem::number);
  CHECK(tissue([](auto& m) { m.stamp.sequence = 0; }) == ProtocolProblem::number);
  CHECK(refused(Hello{.oldest = 0}) == ProtocolProblem::number);
  CHECK(refused(Hello{.oldest = 2, .newest = 1}) == ProtocolProblem::number);
  CHECK(refused(Hello{.role = static_cast<ClientRole>(9)}) == ProtocolProblem::number);
  CHECK(refused(Welcome{.body_rate = 0.0}) == ProtocolProblem::number);
  CHECK(refused(Goodbye{.why = static_cast<Farewell>(0)}) == ProtocolProblem::number);

  Bytes bytes = bytes_of(a_tissue());
  bytes[FrameFormat::header + 49] = std::byte{2};   // neither false nor true
  FrameStream stream;
  give(stream, bytes);
  ProtocolProblem problem{};
  CHECK_FALSE(decode<TissueAnswer>(stream.next().value(), problem));
  CHECK(problem == ProtocolProblem::number);

  Bytes longer = bytes_of(KeepAlive{});
  longer.push_back(std::byte{0});
  longer[8] = std::byte{25};
  FrameStream other;
  give(other, longer);
  Frame const frame = other.next().value();
  CHECK_FALSE(decode<KeepAlive>(frame, problem));
  CHECK(problem == ProtocolProblem::size);
  CHECK_FALSE(decode<Goodbye>(frame, problem));
  CHECK(problem == ProtocolProblem::type);
}

TEST_CASE("encoding, cutting and decoding allocate nothing", "[network]") {
  REQUIRE(palpate_test::trap_works());
  FrameStream stream;
  std::array<std::byte, max_fixed_frame> frame;
  ProtocolProblem problem{};
  RemoteTissue remote;
  palpate_test::AllocationCount const allocations;
  bool good = true;
  for (std::uint64_t k = 1; k <= 1000; ++k) {
    TissueAnswer answer = a_tissue();
    answer.stamp.sequence = k, answer.stamp.pose_discontinuities = 0;
    std::size_t const size = encode(answer, frame);
    auto const room = stream.room();
    std::copy_n(frame.begin(), size, room.begin());
    stream.filled(size);
    auto const whole = stream.next();
    good = good && whole && remote.take(decode<TissueAnswer>(*whole, problem).value(), 2.0);
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(good);
}

// --- what the hand's side makes of answers ---------------------------------------------------------------------------------

TEST_CASE("C5-N1: of answers that come late, twice or out of order the newest alone counts", "[network]") {
  RemoteTissue remote;
  auto const surface = [&](std::uint64_t sequence, double stiffness, std::uint64_t revision = 3) {
    SurfaceAnswer answer = a_surface();
    answer.stamp.sequence = sequence, answer.stamp.pose_discontinuities = 0, answer.stamp.revision = revision;
    answer.patch.stiffness = stiffness;
    return remote.take(answer, 2.0);
  };
  CHECK_FALSE(surface(1, 100.0));   // what it is a surface of is not known yet
  TissueAnswer tissue = a_tissue();
  tissue.stamp.pose_discontinuities = 0;
  CHECK_FALSE(remote.model().valid);
  CHECK(remote.take(tissue, 2.0));
  CHECK(remote.model().valid);
  CHECK_FALSE(remote.take(tissue, 2.1));
  CHECK(surface(4, 400.0));
  CHECK_FALSE(surface(3, 300.0));
  CHECK_FALSE(surface(4, 400.0));
  CHECK(remote.model().surface.stiffness() == 400.0);
  CHECK_FALSE(surface(5, 500.0, 2));   // of a topology that is no more
  CHECK_FALSE(surface(6, 600.0, 4));   // of one whose tissue has not answered yet
  CHECK(remote.model().surface.stiffness() == 400.0);
  CHECK(remote.counts().other_revision == 3);
  CHECK(remote.counts().repeated == 3);
}

TEST_CASE("a surface of a topology that is no more is used for a tenth of a second at most, and none of another server", "[network]") {
  RemoteTissue remote;
  remote.placed(2);
  TissueAnswer tissue = a_tissue();
  CHECK(remote.take(tissue, 2.0));
  CHECK(remote.take(a_surface(), 2.0));
  tissue.stamp.revision = 4;
  for (double const now : {2.05, 2.099}) {
    ++tissue.stamp.sequence;
    CHECK(remote.take(tissue, now));
    CHECK(remote.model().surface.stiffness() == 500.0);
  }
  ++tissue.stamp.sequence;
  CHECK(remote.take(tissue, 2.11));
  CHECK(remote.model().surface.stiffness() == 0.0);
  SurfaceAnswer surface = a_surface();
  surface.stamp.sequence = 10, surface.stamp.revision = 4;
  CHECK(remote.take(surface, 2.12));
  CHECK(remote.model().surface.stiffness() == 500.0);

  auto const restorations = remote.model().restorations;
  auto const sequence = remote.model().surface.sequence;
  remote.reconnected();
  CHECK(remote.model().surface.stiffness() == 0.0);
  CHECK(remote.model().surface.sequence > sequence);
  CHECK(remote.model().restorations == restorations + 1);   // the servo lets the force of before fade
  CHECK(remote.model().tissue_force.norm() == 0.0);
  TissueAnswer first = a_tissue();
  first.stamp.sequence = 1;   // another server counts anew
  CHECK(remote.take(first, 2.2));
  CHECK(remote.model().restorations == restorations + 1);
}

TEST_CASE("answers to where the tool was before it was placed anew do not count", "[network]") {
  RemoteTissue remote;
  remote.placed(3);
  CHECK_FALSE(remote.take(a_tissue(), 2.0));   // it was placed anew twice
  CHECK(remote.counts().other_placement == 1);
  CHECK_FALSE(remote.model().valid);
  remote.placed(2);
  CHECK(remote.take(a_tissue(), 2.0));
}

TEST_CASE("the age of a model is the silence, and what an answer is later than allowed", "[network]") {
  RemoteTissue remote({.max_latency = 0.5});
  remote.placed(2);
  TissueAnswer answer = a_tissue();   // to a sample of 1.5 s
  CHECK(remote.take(answer, 1.7));
  CHECK(remote.model().time == 1.7);
  CHECK(remote.latency() == Approx(0.2));
  ++answer.stamp.sequence;
  CHECK(remote.take(answer, 2.3));   // 0.8 s after its sample: 0.3 s too late
  CHECK(remote.model().time == Approx(2.0));
}

TEST_CASE("no answer makes more force or stiffness than the hand's side allows", "[network]") {
  RemoteTissue remote({.max_stiffness = 800.0, .max_force = 2.0});
  remote.placed(2);
  TissueAnswer tissue = a_tissue();
  tissue.force = {3e6, 0, 4e6};
  tissue.moment = {1e6, 0, 0};
  CHECK(remote.take(tissue, 2.0));
  CHECK(remote.model().tissue_force.norm() == Approx(2.0));
  CHECK(remote.model().tissue_force.x() == Approx(1.2));
  CHECK(remote.model().tissue_moment.norm() == Approx(0.4));   // by the same share
  SurfaceAnswer surface = a_surface();
  surface.patch.stiffness = 9e6;
  CHECK(remote.take(surface, 2.0));
  CHECK(remote.model().surface.stiffness() == 800.0);
  CHECK(remote.counts().clamped == 2);
}

TEST_CASE("what cannot be with a RemoteTissue is refused with the value", "[network]") {
  CHECK_THROWS_WITH(RemoteTissue({.max_latency = 0.0}), Catch::Matchers::Contains(".max_latency is 0 s"));
  CHECK_THROWS_WITH(RemoteTissue({.max_force = -1.0}), Catch::Matchers::Contains(".max_force is -1 N"));
}
