// SPDX-License-Identifier: MIT
// A square sheet, nailed along one side, as a soft body of Bullet and as one of this library: the same particles, masses, springs, drag and
// step; no gravity, no collisions (docs: peers). Times are processor time.
//   bench_bullet --benchmark_filter=step        time: both in turn, medians [µs] and their quotient (`bullet/library`)
//   bench_bullet --benchmark_filter=at_rest     pulled until it rests: error against the closed form
//   bench_bullet --benchmark_filter=in_motion   let go without drag for 30 ms: error against a plain loop with an eighth of the step
//   bench_bullet --benchmark_filter=same_error  the same 30 ms, the library with the largest step whose error is no larger than Bullet's
// Errors are the largest distance between two positions in shares of the largest displacement. The second argument of `step` and
// `in_motion` and the first of `at_rest` are Bullet's position iterations; `at_rest` has Bullet's step in µs last.
#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <BulletSoftBody/btSoftBody.h>
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

constexpr double mass = 3e-4, stiffness = 100.0, spacing = 0.005;   // kg a particle, N/m, m
constexpr double step_size = 1e-4;                                  // s, a tenth of the largest stable one

/// n × n particles; those of the first column are nailed.
struct Sheet {
  int n;
  double drag = 0;   // N s/m
  TriangleMesh<double> mesh = make_grid<double>(n, n, spacing);
  std::vector<std::array<int, 2>> links = edges(mesh);

  int size() const { return n * n; }
  bool nailed(int i) const { return i % n == 0; }
};

template <RealScalar S>
auto library_body(Sheet const& sheet) {
  MassSpring<S> tissue(make_grid<S>(sheet.n, sheet.n, S(spacing)),
                       {.mass = {.total = S(mass * sheet.size()), .lumping = Lumping::equal},
                        .link = {.stiffness = S(stiffness)},
                        .home = {.stiffness = S(0), .damping = S(sheet.drag)}});
  for (int j = 0; j < sheet.n; ++j) tissue.nail(j * sheet.n);
  return SoftBody(std::move(tissue), LeapfrogVerlet{}, WholeBody{});
}

/// A link of Bullet pulls its ends together by the share q of its elongation at each iteration. At rest one iteration has then the tension
///   T = q (1/m_a + 1/m_b)⁻¹ e/h²,   e the elongation before it, e (1 − q) after it,
/// which is a spring of stiffness k for q = s/(1 + s), s = k h² (1/m_a + 1/m_b). For several iterations q is such that they leave as much
/// of one link's elongation as one does.
class BulletBody {
 public:
  BulletBody(Sheet const& sheet, double h, int iterations) : h_(static_cast<btScalar>(h)), body_(make(sheet)) {
    auto const material_for = [&](double inverse_masses) {
      double const s = stiffness * h * h * inverse_masses;
      btSoftBody::Material* const material = body_.appendMaterial();
      material->m_kLST = static_cast<btScalar>(1 - std::pow(1 / (1 + s), 1.0 / iterations));
      return material;
    };
    btSoftBody::Material* const between_free = material_for(2 / mass);
    btSoftBody::Material* const to_nailed = material_for(1 / mass);
    for (auto const& [a, b] : sheet.links)
      if (!sheet.nailed(a) || !sheet.nailed(b)) body_.appendLink(a, b, sheet.nailed(a) || sheet.nailed(b) ? to_nailed : between_free);
    body_.m_cfg.piterations = iterations;
    body_.m_cfg.collisions = 0;
    body_.m_cfg.kDP = static_cast<btScalar>(sheet.drag * h / mass);
    body_.m_cfg.m_psequence.clear();
    body_.m_cfg.m_psequence.push_back(btSoftBody::ePSolver::Linear);
  }

  void push(int i, Vector3<double> const& force) { body_.addForce(vector(force), i); }
  void advance() {
    body_.predictMotion(h_);
    body_.solveConstraints();
    body_.integrateMotion();
  }
  Matrix3X<double> positions() const {
    Matrix3X<double> x(3, body_.m_nodes.size());
    for (int i = 0; i < body_.m_nodes.size(); ++i) {
      btVector3 const& p = body_.m_nodes[i].m_x;
      x.col(i) << double(p.x()), double(p.y()), double(p.z());
    }
    return x;
  }

 private:
  static btVector3 vector(Vector3<double> const& v) {
    return {static_cast<btScalar>(v[0]), static_cast<btScalar>(v[1]), static_cast<btScalar>(v[2])};
  }
  btSoftBody make(Sheet const& sheet) {
    world_.m_gravity.setZero();
    std::vector<btVector3> points;
    std::vector<btScalar> masses;
    for (int i = 0; i < sheet.size(); ++i) {
      points.push_back(vector(sheet.mesh.points.col(i)));
      masses.push_back(sheet.nailed(i) ? btScalar(0) : static_cast<btScalar>(mass));   // no mass stays where it is
    }
    return {&world_, sheet.size(), points.data(), masses.data()};
  }

  btScalar h_;
  btSoftBodyWorldInfo world_;
  btSoftBody body_;
};

/// Forces of plain Hooke springs at the positions x.
Matrix3X<double> link_forces(Sheet const& sheet, Matrix3X<double> const& x) {
  Matrix3X<double> forces = Matrix3X<double>::Zero(3, x.cols());
  for (auto const& [a, b] : sheet.links) {
    Vector3<double> const d = x.col(a) - x.col(b);
    double const rest = (sheet.mesh.points.col(a) - sheet.mesh.points.col(b)).norm(), length = d.norm();
    Vector3<double> const pull = stiffness * (length - rest) / length * d;
    forces.col(a) -= pull;
    forces.col(b) += pull;
  }
  return forces;
}

/// Two percent longer across the nailed side: around every inner particle opposite links pull alike, so forces on the free sides alone hold it.
Matrix3X<double> stretched(Sheet const& sheet) {
  Matrix3X<double> x = sheet.mesh.points;
  x.row(0) *= 1.02;
  return x;
}

struct Push {
  int particle;
  Vector3<double> force;
};
std::vector<Push> stretching_forces(Sheet const& sheet) {
  Matrix3X<double> const forces = link_forces(sheet, stretched(sheet));
  std::vector<Push> pushes;
  for (int i = 0; i < sheet.size(); ++i)
    if (!sheet.nailed(i) && forces.col(i).norm() > 1e-12) pushes.push_back({i, -forces.col(i)});
  return pushes;
}

double error_of(Sheet const& sheet, Matrix3X<double> const& x, Matrix3X<double> const& exact) {
  return (x - exact).colwise().norm().maxCoeff() / (exact - sheet.mesh.points).colwise().norm().maxCoeff();
}

template <RealScalar S>
Matrix3X<double> library_after(Sheet const& sheet, std::vector<Push> const& pushes, int steps, double h = step_size) {
  auto body = library_body<S>(sheet);
  for (int k = 0; k < steps; ++k) {
    for (Push const& p : pushes) body.apply_force(p.particle, p.force.template cast<S>());
    body.step(S(h));
  }
  return body.positions().template cast<double>();
}

Matrix3X<double> bullet_after(Sheet const& sheet, std::vector<Push> const& pushes, int steps, double h, int iterations) {
  BulletBody body(sheet, h, iterations);
  for (int k = 0; k < steps; ++k) {
    for (Push const& p : pushes) body.push(p.particle, p.force);
    body.advance();
  }
  return body.positions();
}

double median(std::vector<double> values) {
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Both in turn, as many steps each as take the library a millisecond or less. Every 61st particle is pushed to and fro.
template <RealScalar S>
void step(benchmark::State& state) {
  Sheet const sheet{.n = static_cast<int>(state.range(0))};
  auto library = library_body<S>(sheet);
  BulletBody bullet(sheet, step_size, static_cast<int>(state.range(1)));
  int const steps = std::max(2, 60000 / sheet.size());
  int time = 0;
  auto const push = [&](auto apply) {
    double const force = 0.03 * std::sin(0.05 * ++time);
    for (int i = 7; i < sheet.size(); i += 61) apply(i, Vector3<double>(force, -force, force));
  };
  auto const library_step = [&] {
    push([&](int i, Vector3<double> const& force) { library.apply_force(i, force.template cast<S>()); });
    library.step(S(step_size));
  };
  auto const bullet_step = [&] {
    push([&](int i, Vector3<double> const& force) { bullet.push(i, force); });
    bullet.advance();
  };
  library_step();   // finds its stable step and lays out its springs
  time = 0;
  bullet_step();
  std::vector<double> of_library, of_bullet;
  for (auto _ : state) {
    int const first = time;
    std::clock_t const start = std::clock();
    for (int k = 0; k < steps; ++k) bullet_step();
    std::clock_t const middle = std::clock();
    time = first;
    for (int k = 0; k < steps; ++k) library_step();
    std::clock_t const end = std::clock();
    of_bullet.push_back(static_cast<double>(middle - start) / CLOCKS_PER_SEC / steps * 1e6);
    of_library.push_back(static_cast<double>(end - middle) / CLOCKS_PER_SEC / steps * 1e6);
  }
  state.counters["bullet_us"] = median(of_bullet);
  state.counters["library_us"] = median(of_library);
  state.counters["bullet/library"] = median(of_bullet) / median(of_library);
}

/// Three seconds under the forces of the closed form, with a third of the drag that damps the slowest wave along the sheet critically: its
/// shear waves are slower still.
void at_rest(benchmark::State& state) {
  int const iterations = static_cast<int>(state.range(0)), n = 31;
  double const h = static_cast<double>(state.range(1)) * 1e-6, duration = 3.0;
  Sheet const sheet{.n = n, .drag = std::sqrt(stiffness * mass) / (n - 1)};
  auto const pushes = stretching_forces(sheet);
  auto const exact = stretched(sheet);
  Matrix3X<double> library, single, bullet;
  for (auto _ : state) {
    library = library_after<double>(sheet, pushes, static_cast<int>(std::lround(duration / step_size)));
    single = library_after<float>(sheet, pushes, static_cast<int>(std::lround(duration / step_size)));
    bullet = bullet_after(sheet, pushes, static_cast<int>(std::lround(duration / h)), h, iterations);
  }
  state.counters["bullet_error"] = error_of(sheet, bullet, exact);
  state.counters["library_error"] = error_of(sheet, library, exact);
  state.counters["library_float_error"] = error_of(sheet, single, exact);
}

/// Velocity Verlet over plain Hooke springs, no code of the library's.
Matrix3X<double> plain_after(Sheet const& sheet, std::vector<Push> const& pushes, int steps, double h) {
  Matrix3X<double> applied = Matrix3X<double>::Zero(3, sheet.size());
  for (Push const& p : pushes) applied.col(p.particle) = p.force;
  auto const acceleration = [&](Matrix3X<double> const& x) {
    Matrix3X<double> a = (link_forces(sheet, x) + applied) / mass;
    for (int j = 0; j < sheet.n; ++j) a.col(j * sheet.n).setZero();
    return a;
  };
  Matrix3X<double> x = sheet.mesh.points, v = Matrix3X<double>::Zero(3, sheet.size()), a = acceleration(x);
  for (int k = 0; k < steps; ++k) {
    x += h * v + h * h / 2 * a;
    Matrix3X<double> const next = acceleration(x);
    v += h / 2 * (a + next);
    a = next;
  }
  return x;
}

void in_motion(benchmark::State& state) {
  Sheet const sheet{.n = static_cast<int>(state.range(0))};
  int const steps = 300, finer = 8;
  auto const pushes = stretching_forces(sheet);
  Matrix3X<double> exact, library, single, bullet;
  for (auto _ : state) {
    exact = plain_after(sheet, pushes, steps * finer, step_size / finer);
    library = library_after<double>(sheet, pushes, steps);
    single = library_after<float>(sheet, pushes, steps);
    bullet = bullet_after(sheet, pushes, steps, step_size, static_cast<int>(state.range(1)));
  }
  state.counters["bullet_error"] = error_of(sheet, bullet, exact);
  state.counters["library_error"] = error_of(sheet, library, exact);
  state.counters["library_float_error"] = error_of(sheet, single, exact);
}

void same_error(benchmark::State& state) {
  Sheet const sheet{.n = static_cast<int>(state.range(0))};
  int const steps = 300, finer = 8;
  auto const pushes = stretching_forces(sheet);
  Matrix3X<double> const exact = plain_after(sheet, pushes, steps * finer, step_size / finer);
  double const allowed = error_of(sheet, bullet_after(sheet, pushes, steps, step_size, 1), exact);
  int larger = 1;
  double error = 0;
  for (int const candidate : {1, 2, 3, 4, 5, 6, 10}) {
    double const found = error_of(sheet, library_after<double>(sheet, pushes, steps / candidate, candidate * step_size), exact);
    if (found <= allowed) larger = candidate, error = found;
  }
  auto library = library_body<double>(sheet);
  BulletBody bullet(sheet, step_size, 1);
  auto const library_steps = [&](int count) {
    for (int k = 0; k < count; ++k) {
      for (Push const& p : pushes) library.apply_force(p.particle, p.force);
      library.step(larger * step_size);
    }
  };
  library_steps(1);
  std::vector<double> ratios;
  for (auto _ : state) {
    std::clock_t const start = std::clock();
    for (int k = 0; k < steps; ++k) {
      for (Push const& p : pushes) bullet.push(p.particle, p.force);
      bullet.advance();
    }
    std::clock_t const middle = std::clock();
    library_steps(steps / larger);
    std::clock_t const end = std::clock();
    ratios.push_back(static_cast<double>(middle - start) / static_cast<double>(end - middle));
  }
  state.counters["bullet/library"] = median(ratios);
  state.counters["bullet_error"] = allowed;
  state.counters["library_error"] = error;
  state.counters["larger_step"] = larger;
}

BENCHMARK(step<double>)->ArgsProduct({{31, 100, 200}, {1, 4, 10}})->Unit(benchmark::kMillisecond);
BENCHMARK(step<float>)->ArgsProduct({{31, 100, 200}, {1, 4, 10}})->Unit(benchmark::kMillisecond);
BENCHMARK(at_rest)->ArgsProduct({{1, 4, 10}, {100, 300, 1000}})->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(in_motion)->ArgsProduct({{31, 100, 200}, {1, 4, 10}})->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(same_error)->Arg(31)->Arg(100)->Arg(200)->Iterations(5)->Unit(benchmark::kSecond);

}  // namespace
