// SPDX-License-Identifier: MIT
// Yardstick: the body itself at the moment of publishing.
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/simulator/snapshot.hpp>

#include <atomic>
#include <thread>

using namespace palpate;

TEMPLATE_TEST_CASE("a snapshot is the body as it was", "[simulator][snapshot]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto body = palpate_test::skin<S>(WholeBody{});
  SnapshotChannel<S> channel;
  CHECK_FALSE(channel.fetch());
  CHECK(channel.latest().points.cols() == 0);
  body.apply_force(220, {0, 0, S(-1)});
  for (int k = 0; k < 20; ++k) body.step(S(1e-4));
  channel.publish(body, 1.5, Vector3<S>(1, 2, 3), CuttingPhase::indenting);
  Matrix3X<S> const points = body.positions();
  for (int k = 0; k < 20; ++k) body.step(S(1e-4));   // the body goes on; the snapshot stays
  REQUIRE(channel.fetch());
  BodySnapshot<S> const& shot = channel.latest();
  CHECK(shot.time == 1.5);
  CHECK(shot.tip == Vector3<S>(1, 2, 3));
  CHECK(shot.phase == CuttingPhase::indenting);
  CHECK(shot.points == points);
  CHECK(shot.points != Matrix3X<S>(body.positions()));
  CHECK(shot.triangles == body.triangles());
  CHECK_FALSE(channel.fetch());
  CHECK(channel.latest().time == 1.5);
}

TEST_CASE("a snapshot has the triangles of its own points, however many were missed in between", "[simulator][snapshot]") {
  // Three slots, each with the triangles of another time: published and fetched in different rhythms while a cut adds and takes away
  // particles, every snapshot has to be the body of its moment.
  auto body = palpate_test::skin<double>(WholeBody{});
  ProgressiveCutter<double> cutter({.puncture_depth = 0.002, .snap = 2e-4});
  SnapshotChannel<double> channel;
  std::size_t revision = 0;
  int changes = 0, shots = 0;
  for (int k = 0; k <= 400; ++k) {
    cutter.advance(body, Vector3<double>(0.0312 + 1e-4 * std::max(0, k - 50), 0.0533, 0.002 - 1e-4 * std::min(k, 60)));
    if (k % 3 != 0) channel.publish(body, 1e-3 * k, {0, 0, 0}, cutter.state());
    if (k % 7 < 4 && channel.fetch()) {
      ++shots;
      BodySnapshot<double> const& shot = channel.latest();
      CHECK(shot.topology_revision >= revision);
      if (shot.topology_revision != revision) ++changes;
      revision = shot.topology_revision;
      if (k % 3 == 0) continue;   // it may be of the tick before
      auto const drawn = body.drawn_mesh();   // with the triangle that the blade is in divided
      CHECK(shot.points == drawn.points);
      REQUIRE(shot.triangles.cols() == drawn.triangles.cols());
      CHECK(shot.triangles == drawn.triangles);
      CHECK(shot.topology_revision == body.topology_revision());
    }
  }
  CHECK(shots > 100);
  CHECK(changes > 10);
}

TEST_CASE("a snapshot without a change of topology allocates nothing after the first three", "[simulator][snapshot]") {
  REQUIRE(palpate_test::trap_works());
  auto body = palpate_test::skin<double>(WholeBody{});
  SnapshotChannel<double> channel;
  auto const publish = [&](int count) {
    for (int k = 0; k < count; ++k) {
      channel.publish(body, 0.0, {0, 0, 0}, CuttingPhase::no_contact);
      channel.fetch();
    }
  };
  publish(3);
  palpate_test::AllocationCount const allocations;
  publish(100);
  long const count = allocations.count();
  CHECK(count == 0);
}

TEST_CASE("a renderer on its own thread sees only whole snapshots", "[simulator][snapshot][threads]") {
  auto body = palpate_test::skin<double>(WholeBody{});
  ProgressiveCutter<double> cutter({.puncture_depth = 0.002, .snap = 2e-4});
  SnapshotChannel<double> channel;
  std::atomic<bool> done{false};
  long seen = 0, broken = 0;
  std::thread renderer([&] {
    std::size_t revision = 0;
    double time = -1.0;
    for (bool last = false; !last;) {
      last = done.load();
      if (!channel.fetch()) {
        std::this_thread::yield();
        continue;
      }
      ++seen;
      BodySnapshot<double> const& shot = channel.latest();
      bool const whole = shot.topology_revision >= revision && shot.time > time && shot.triangles.minCoeff() >= 0 &&
                         shot.triangles.maxCoeff() + 1 == shot.points.cols() && shot.points.allFinite() && shot.tip.x() == shot.time;
      if (!whole) ++broken;
      revision = shot.topology_revision;
      time = shot.time;
    }
  });
  for (int k = 0; k <= 2000; ++k) {
    cutter.advance(body, Vector3<double>(0.0312 + 2e-5 * std::max(0, k - 50), 0.0533, 0.002 - 1e-4 * std::min(k, 60)));
    channel.publish(body, 1e-3 * k, {1e-3 * k, 0, 0}, cutter.state());
    if (k % 10 == 0) std::this_thread::yield();
  }
  done.store(true);
  renderer.join();
  CHECK(seen > 0);
  CHECK(broken == 0);
}
