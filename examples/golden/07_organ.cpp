// From the skin of an organ to a solid with a hard nodule inside, which a finger finds by pressing.
#include <palpate/palpate.hpp>
#include <palpate/volume.hpp>

#include <cstdio>
#include <utility>
#include <vector>

int main() {
  using namespace palpate;

  TriangleMesh<double> const skin = make_sphere<double>(0.03, 3);                  // 3 cm
  Filling<double> const solid = fill(skin, {.edge = 0.006});                       // lattice constant; what became of the skin is told too
  Vector3<double> const nodule{0.0, 0.0, 0.016};

  FiniteElements<double, StableNeoHookean<double>> tissue(solid.mesh, {.density = 1060.0, .material = {.young = 5e3, .poisson = 0.45}});
  tissue.set_material(tetrahedra_where(solid.mesh, [&](Vector3<double> const& centre) { return (centre - nodule).norm() < 0.008; }),
                      {.young = 1e5, .poisson = 0.45});
  tissue.nail(vertices_where(solid.mesh, [](Vector3<double> const& p) { return p.z() < -0.015; }));

  SoftBody body(std::move(tissue), BackwardEuler{});
  auto const press = [&](Vector3<double> const& where) {                            // 4 mm inwards, slowly; the force that holds it there
    std::vector<int> const pad = vertices_where(solid.mesh, [&](Vector3<double> const& p) { return (p - where).norm() < 0.008 && p.norm() > 0.0275; });
    Vector3<double> const in = -0.004 * where.normalized();
    for (int step = 1; step <= 50; ++step) {
      for (int const i : pad) body.drag(i, solid.mesh.points.col(i) + in * (step / 50.0));
      body.step(20e-3);
    }
    Vector3<double> force = Vector3<double>::Zero();
    for (int const i : pad) force += body.reaction(i);
    for (int const i : pad) body.release(i);
    for (int step = 0; step < 100; ++step) body.step(20e-3);
    return force.norm();
  };
  double const above = press({0.0, 0.0, 0.03}), beside = press({0.03, 0.0, 0.0});
  std::printf("smallest dihedral angle above 10 degrees: %s\n", solid.smallest_dihedral > 10.0 ? "yes" : "no");
  std::printf("harder above the nodule: %s\n", above > 1.1 * beside ? "yes" : "no");
}
