// SPDX-License-Identifier: MIT
// Any bytes as what comes over a network, to both sides: what is no message ends the connection, and nothing makes a force that is no number or above its limit,
// or a body that is not finite. A first byte of 128 and more: bytes as they are; below: a type, a length and so many bytes of a body, again and again.
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/network/picture_messages.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/network/remote_tissue.hpp>
#include <palpate/network/surface_then_tissue.hpp>
#include <palpate/network/tissue_node.hpp>
#include <palpate/simulator/servo_loop.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
constexpr double max_force = 3.3;   // N, of the device

void require(bool good) {
  if (!good) std::abort();
}

auto sheet() {
  auto const skin = make_grid<double>(5, 5, 0.005);
  MassSpring<double> tissue(skin, {.mass = {.total = 0.02}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 8.0, .damping = 0.1}});
  tissue.nail(boundary_vertices(skin));
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}

/// Both sides of a connection, to which the same bytes come.
class Sides {
 public:
  Sides() : servo_(ScriptedDevice<double>({{0.0, {0.01, 0.01, 0.002}}, {0.05, {0.01, 0.01, -0.003}}}, {.max_force = max_force}), SurfaceThenTissue<double>{}) {
    servo_.begin_session(100.0);
  }
  void take(Frame const& frame) {
    ProtocolProblem problem{};
    now_ += 0.001;
    if (auto const report = decode<HandReport>(frame, problem)) {
      if (!tissue_) tissue_.emplace(sheet(), NoCutter<double>{}, TissueNodeOptions{.max_body_steps = 10});   // only then: it takes long
      tissue_->take(*report, now_);
      if (++reports_ % 4 == 0) tick_body();
      require(surface_.look(tissue_->captured(), *report, now_, 0.02).valid());
    }
    if (auto const answer = decode<SurfaceAnswer>(frame, problem)) remote_.take(*answer, now_);
    if (auto const answer = decode<TissueAnswer>(frame, problem)) remote_.take(*answer, now_);
    static_cast<void>(decode<Hello>(frame, problem)), static_cast<void>(decode<Welcome>(frame, problem)), static_cast<void>(decode<Refusal>(frame, problem));
    static_cast<void>(decode<KeepAlive>(frame, problem)), static_cast<void>(decode<Goodbye>(frame, problem));
    look_on(frame);
    tick_servo();
  }
  /// Whatever is drawn is a picture: finite points, and triangles between them.
  void look_on(Frame const& frame) {
    ProtocolProblem problem{};
    if (frame.type == MessageType::triangles) static_cast<void>(picture_.take_triangles(frame));
    if (frame.type == MessageType::points) static_cast<void>(picture_.take_points(frame));
    auto const drawn = decode<Drawn>(frame, problem);
    if (!drawn || picture_.check(*drawn) != ProtocolProblem::none) return;
    picture_.draw(*drawn, shown_);
    require(shown_.points.allFinite() && shown_.points.cols() == drawn->points && shown_.triangles.cols() == drawn->triangles);
    require(shown_.triangles.cols() == 0 || (shown_.triangles.minCoeff() >= 0 && shown_.triangles.maxCoeff() < shown_.points.cols()));
  }
  void tick_servo() {
    servo_.read(0.001);
    remote_.placed(servo_.pose_discontinuities());
    Tick const tick = servo_.respond(remote_.model(), now_);
    require(is_finite(tick.force) && tick.force.norm() <= max_force * (1.0 + 1e-12));
    require(is_finite(remote_.shown(tick.tip)));
  }
  void tick_body() {
    if (!tissue_) return;
    TissueAnswer const& answer = tissue_->tick(0.01, now_);
    require(answer.valid());
    require(tissue_->body().positions().allFinite());
  }

 private:
  std::optional<TissueNode<decltype(sheet()), NoCutter<double>>> tissue_;
  SurfaceNode<double> surface_;
  ServoLoop<ScriptedDevice<double>, SurfaceThenTissue<double>, double> servo_;
  RemoteTissue remote_;
  PictureAssembly picture_;
  BodySnapshot<float> shown_;
  double now_ = 0.0;
  int reports_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  if (size == 0) return 0;
  Sides sides;
  std::vector<std::byte> bytes;
  if (data[0] >= 128) {
    bytes.assign(reinterpret_cast<std::byte const*>(data + 1), reinterpret_cast<std::byte const*>(data + size));
  } else {
    for (std::size_t at = 1; at + 2 <= size;) {
      auto const type = static_cast<MessageType>(1 + data[at] % 11);
      std::size_t const length = std::min<std::size_t>(data[at + 1], size - at - 2), begin = bytes.size();
      bytes.resize(begin + FrameFormat::header + length);
      detail::network::put_header(bytes.data() + begin, type, length);
      std::copy_n(reinterpret_cast<std::byte const*>(data + at + 2), length, bytes.data() + begin + FrameFormat::header);
      at += 2 + length;
    }
  }
  FrameStream stream;
  for (std::size_t at = 0; at < bytes.size();) {
    auto const room = stream.room();
    require(!room.empty());
    std::size_t const part = std::min({room.size(), bytes.size() - at, std::size_t{97}});
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), part, room.begin());
    stream.filled(part);
    at += part;
    while (auto const frame = stream.next()) sides.take(*frame);
    if (stream.problem() != ProtocolProblem::none) break;
  }
  for (int k = 0; k < 3; ++k) sides.tick_servo();
  sides.tick_body();
  return 0;
}
