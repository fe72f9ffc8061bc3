// SPDX-License-Identifier: MIT
// Bodies on one another: a slab rests on a table, slides on a slope, and an egg sinks into a cushion.
//   at rest    d = δ p/k,   p A = m g
//   a slope    holds while tan α < μ; above it slides with g (sin α − μ cos α)
#include "../album.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/contact/body_contact.hpp>
#include <palpate/contact/obstacle.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace {

using namespace palpate;
using Vector = Vector3<double>;

constexpr double g = 9.81, density = 1000.0, friction = 0.4, height = 0.02;   // m/s², kg/m³, m
constexpr BodyContactOptions<double> options{.pressure = 1e4, .depth = 3e-3, .friction = friction};

TetrahedralMesh<double> block(int nx, int ny, int nz, Vector const& low, double edge = 0.01) {
  auto mesh = make_block<double>(nx, ny, nz, edge, BlockPattern::alternating);
  mesh.points.colwise() += low;
  return mesh;
}
/// A block that is bent to an ellipsoid.
TetrahedralMesh<double> egg(Vector const& half, Vector const& at) {
  auto mesh = block(6, 6, 6, {-1, -1, -1}, 0.4);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
    Vector const p = mesh.points.col(i);
    double const size = p.norm();
    mesh.points.col(i) = at + half.cwiseProduct(size > 0 ? Vector(p.cwiseAbs().maxCoeff() / size * p) : p);
  }
  return mesh;
}
template <class Integrator>
auto flesh(TetrahedralMesh<double> const& mesh, Integrator integrator, double young, double drag = 0) {
  return SoftBody(FiniteElements<double, StableNeoHookean<double>>(mesh, {.density = density, .material = {.young = young, .poisson = 0.3}, .damping = {.alpha = drag, .beta = 1e-3}}),
                  integrator);
}
Obstacle<double> table() {
  auto skin = surface(block(2, 2, 2, {-0.5, -0.5, -1.0}, 1.0));
  repair(skin);
  return Obstacle<double>(skin);
}
template <class Body>
double speed(Body const& body) {   // m/s, of its middle along x
  double sum = 0;
  for (int i = 0; i < body.size(); ++i) sum += body.tissue().mass(i) * body.velocities()(0, i);
  return sum / body.total_mass();
}

template <class Body>
double rest_depth(Body body, double h) {
  auto ground = table();
  BodyContact contact(body, ground, options);
  body.set_gravity({0, 0, -g});
  for (double t = 0; t < 1; t += h) contact.apply(body, ground, h), body.advance(h);
  return contact.regions()[0].volume / contact.regions()[0].area;
}

/// m/s², and how far it went in a tenth of a second [m], a while after it was let go.
struct Slide {
  double acceleration, way;
};
Slide slide(double tangent) {
  double const angle = std::atan(tangent), h = 2e-3;
  auto body = flesh(block(4, 4, 2, {0, 0, 0}), BackwardEuler{}, 5e4);
  auto ground = table();
  BodyContact contact(body, ground, options);
  auto const advance = [&](double seconds) {
    for (double t = 0; t < seconds - h / 2; t += h) contact.apply(body, ground, h), body.advance(h);
  };
  body.set_gravity({0, 0, -g * std::cos(angle)});
  advance(0.3);
  body.set_gravity({g * std::sin(angle), 0, -g * std::cos(angle)});
  advance(0.2);
  double const begun = speed(body), from = body.positions().row(0).mean();
  advance(0.1);
  return {(speed(body) - begun) / 0.1, body.positions().row(0).mean() - from};
}

drawing::Album contact_example() {
  using namespace drawing;
  std::printf("a slab %.0f mm thick rests in the table by, at most %.4f mm by hand\n", 1e3 * height, 1e3 * options.depth * density * g * height / options.pressure);
  auto const slab = block(4, 4, 3, {0, 0, 0});
  std::printf("%-16s %9s %11s\n", "integrator", "step [ms]", "depth [mm]");
  std::printf("%-16s %9.2f %11.4f\n", "leapfrog", 0.5, 1e3 * rest_depth(flesh(slab, LeapfrogVerlet{}, 1e4, 0.5), 5e-4));
  for (double const h : {1e-3, 1e-2}) std::printf("%-16s %9.2f %11.4f\n", "backward Euler", 1e3 * h, 1e3 * rest_depth(flesh(slab, BackwardEuler{}, 1e4, 0.5), h));

  Picture slopes("contact_slope", "A soft slab on a slope, friction 0.4: dots computed, line by hand", "tan of the slope", "acceleration [m/s²]");
  auto &line = slopes.line(blue, "g (sin a − μ cos a), or 0"), &dots = slopes.dots(orange, "computed");
  auto const by_hand = [](double tangent) { return std::max(0.0, g * (std::sin(std::atan(tangent)) - friction * std::cos(std::atan(tangent)))); };
  sample(line, 0.0, 0.85, 1, by_hand);
  double off = 0, crept = 0;
  for (int k = 1; k <= 8; ++k) {
    double const tangent = 0.1 * k + (k == 4 ? -0.01 : 0.0);
    Slide const found = slide(tangent);
    add(dots, tangent, found.acceleration);
    off = std::max(off, std::abs(found.acceleration - by_hand(tangent)));
    if (tangent < friction) crept = std::max(crept, std::abs(found.way));
  }
  std::printf("on slopes, at most %.3f m/s2 from the acceleration by hand\n", off);
  std::printf("where it holds, it moves by %.2f um in 0.1 s\n", 1e6 * crept);

  auto const filled = block(11, 11, 4, {-0.05, -0.05, -0.03});
  auto cushion = flesh(filled, BackwardEuler{}, 3e3, 1.0), stone = flesh(egg({0.025, 0.02, 0.015}, {0.002, 0.001, 0.0165}), BackwardEuler{}, 2e4, 1.0);
  for (int const i : vertices_where(filled, [](Vector const& x) { return x[2] < -0.029; })) cushion.nail(i);
  stone.set_gravity({0, 0, -3 * g});
  BodyContact contact(stone, cushion, options);
  for (double t = 0; t < 1; t += 2e-3) contact.apply(stone, cushion, 2e-3), stone.advance(2e-3), cushion.advance(2e-3);
  std::printf("an egg of %.1f g, pressed as by three times its weight: the cushion bears %.4f N of %.4f N\n", 1e3 * stone.total_mass(), contact.force()[2],
              3 * g * stone.total_mass());
  TriangleMesh<double> both = cushion.mesh();
  auto const upper = stone.mesh();
  int const n = static_cast<int>(both.points.cols()), t = static_cast<int>(both.triangles.cols());
  both.points.conservativeResize(3, n + upper.points.cols()), both.triangles.conservativeResize(3, t + upper.triangles.cols());
  both.points.rightCols(upper.points.cols()) = upper.points, both.triangles.rightCols(upper.triangles.cols()) = (upper.triangles.array() + n).matrix();
  return {.charts = {slopes}, .views = {{.name = "contact_egg", .mesh = both, .from = Vector(0.3, -1.0, 0.55)}}};
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("contact", argc, argv, contact_example); }
