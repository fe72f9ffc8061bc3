// SPDX-License-Identifier: MIT
// A body of one's own needs palpate/extend/body.hpp and nothing else. Yardstick: the closed form of a damped oscillator, and the battery.
#include <palpate/extend/body.hpp>

#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <cmath>
#include <utility>

/// A bone that gives way as a whole: a rigid surface of mass m on a spring and a damper, m u″ + c u′ + k u = Σ f. A step is implicit: any is stable.
template <class ScalarType>
class SprungBone : public palpate::SkinBody<ScalarType> {
  using Base = palpate::SkinBody<ScalarType>;

 public:
  using Scalar = ScalarType;
  using Vector = palpate::Vector3<Scalar>;
  struct Options {
    Scalar mass = 1, stiffness = 1000, damping = 10;   // kg, N/m, N·s/m
  };
  struct Report {
    bool diverged = false;
    int moving = 0;
    explicit operator bool() const { return !diverged; }
  };

  SprungBone(palpate::TriangleMesh<Scalar> const& skin, Options const& options) : Base(skin, {.closed = true}), options_(options) {}

  void apply_force(int i, Vector const& force) {
    this->check(i), this->check_force(i, force);
    load_ += force;
  }
  Report step(Scalar h) {
    this->check_step(h);
    Vector const velocity = next_velocity(h), u = this->displacement(0) + h * velocity;
    load_.setZero();
    if (!(u.norm() < 1000 * this->home_diagonal())) return {.diverged = true};
    for (int i = 0; i < this->size(); ++i) this->displace(i, u, velocity);
    return {.moving = this->size()};
  }
  Vector predicted_acceleration(int, Scalar h) const { return (next_velocity(h) - this->velocities().col(0)) / h; }
  Scalar mobility(int, int, Scalar h) const { return 1 / mass_of(h); }

  struct State {
    typename Base::SkinState skin;
    Vector u, v, load;
  };
  State save() const { return {this->save_skin(), this->displacement(0), this->velocities().col(0), load_}; }
  void restore(State const& state) {
    this->restore_skin(state.skin);
    for (int i = 0; i < this->size(); ++i) this->displace(i, state.u, state.v);
    load_ = state.load;
  }

 private:
  Scalar mass_of(Scalar h) const { return options_.mass + h * options_.damping + h * h * options_.stiffness; }
  Vector next_velocity(Scalar h) const {
    return (options_.mass * this->velocities().col(0) + h * (load_ - options_.stiffness * this->displacement(0))) / mass_of(h);
  }

  Options options_;
  Vector load_ = Vector::Zero();   // N
};
static_assert(palpate::SimulatedBody<SprungBone<double>> && palpate::SearchableBody<SprungBone<float>> && palpate::StatesMobility<SprungBone<double>>);
static_assert(palpate::SimulatedBody<palpate::testing::BodyArchetype<double>> && !palpate::CountsRenumberings<palpate::testing::BodyArchetype<double>>);

using namespace palpate;

TEMPLATE_TEST_CASE("a body of one's own keeps the laws of bodies", "", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const sphere = make_sphere<S>(S(0.05), 6);
  CHECK(testing::to_text(testing::check_body(SprungBone<S>(sphere, {}))) == "");
  // And one of the library's, of particles with masses.
  MassSpring<S> tissue(sphere, {.link = {.stiffness = 100, .damping = S(0.1)}, .home = {.stiffness = 50}});
  tissue.nail(3);
  CHECK(testing::to_text(testing::check_body(SoftBody(std::move(tissue)))) == "");
}

TEST_CASE("a bone on a spring swings as the closed form says") {
  SprungBone<double> bone(make_sphere<double>(0.05, 6), {.mass = 0.5, .stiffness = 800, .damping = 4});
  double const h = 1e-5, force = 2, decay = 4 / (2 * 0.5), omega = std::sqrt(800 / 0.5 - decay * decay);
  double worst = 0;
  for (int k = 1; k <= 20000; ++k) {
    bone.apply_force(3, {0, 0, force});
    bone.step(h);
    double const t = k * h, exact = force / 800 * (1 - std::exp(-decay * t) * (std::cos(omega * t) + decay / omega * std::sin(omega * t)));
    worst = std::max(worst, std::abs(bone.positions()(2, 7) - bone.reference_position(7)[2] - exact));
  }
  CHECK(worst < 1e-3 * force / 800);
}

namespace {

auto skin() { return make_sphere<double>(0.05, 6); }
using Bone = SprungBone<double>;

struct Heavier : Bone {   // what it predicts is not what it says a force adds
  using Bone::Bone;
  double mobility(int i, int j, double h) const { return Bone::mobility(i, j, h) / 2; }
};
struct Lopsided : Bone {
  using Bone::Bone;
  double mobility(int i, int j, double h) const { return Bone::mobility(i, j, h) * (i < j ? 1.5 : 1); }
};
struct Forgetful : Bone {   // a force for the next step is no part of its state
  using Bone::Bone;
  State save() const {
    State state = Bone::save();
    state.load.setZero();
    return state;
  }
};
struct Blind : Bone {
  using Bone::Bone;
  SurfacePoint<double> nearest_point(Vector const& point, int = -1) { return Bone::nearest_point(Vector(point + Vector(0, 0, 0.01))); }
};
struct Careless : Bone {
  using Bone::Bone;
  void apply_force(int i, Vector const& force) {
    if (i >= 0 && i < size()) Bone::apply_force(i, force);
  }
};

struct Boaster : Bone {   // all it says is a thousand times too much
  using Bone::Bone;
  Vector predicted_acceleration(int i, double h) const { return 1000 * Bone::predicted_acceleration(i, h); }
  double mobility(int i, int j, double h) const { return 1000 * Bone::mobility(i, j, h); }
};
struct Restless : Bone {
  using Bone::Bone;
  Report step(double h) {
    for (int i = 0; i < size(); ++i) displace(i, Vector(displacement(i) + Vector(0.001, 0, 0)));
    return Bone::step(h);
  }
};
struct Pessimist : Bone {
  using Bone::Bone;
  Report step(double h) { return (Bone::step(h), Report{.diverged = true}); }
};
struct Silent : Bone {   // does not say that it refused a step
  using Bone::Bone;
  Report step(double h) { return (Bone::step(h), Report{}); }
};

}  // namespace

TEST_CASE("a body that is wrong is told so") {
  auto const found = [](auto const& body) { return testing::to_text(testing::check_body(body)); };
  CHECK_THAT(found(Heavier(skin(), {})), says("a force on particle", "at most"));
  CHECK_THAT(found(Lopsided(skin(), {})), says("mobility", "symmetric"));
  CHECK_THAT(found(Forgetful(skin(), {})), says("after restore it goes on in another way"));
  CHECK_THAT(found(Blind(skin(), {})), says("nearest_point", "m away"));
  CHECK_THAT(found(Careless(skin(), {})), says("a force on particle -1 is taken"));
  CHECK_THAT(found(Bone(skin(), {.mass = -1})), says("must be positive"));
  CHECK_THAT(found(Boaster(skin(), {})), says("in a step, and what is predicted is"));
  CHECK_THAT(found(Restless(skin(), {})), says("at rest, without a force"));
  CHECK_THAT(found(Pessimist(skin(), {})), says("reports that it diverged"));
  CHECK_THAT(found(Silent(skin(), {})), says("does not report that it was refused"));
  CHECK(found(testing::BodyArchetype<double>(skin())) == "");
}
