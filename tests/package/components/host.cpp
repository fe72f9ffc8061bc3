// SPDX-License-Identifier: MIT
// Uses one thing of each component that was asked for, and checks what it gives.
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>

#include <cmath>
#include <cstdio>

#ifdef with_collision
#include <palpate/collision/fcl_surface.hpp>
#endif
#ifdef with_haply
#include <palpate/haply/options.hpp>

#include <boost/beast/version.hpp>
#include <nlohmann/json_fwd.hpp>
#endif
#ifdef with_json
#include <palpate/force/liver.hpp>
#include <palpate/json/network_file.hpp>
#endif
#ifdef with_network
#include <palpate/network/network.hpp>

#include <boost/asio/version.hpp>
#endif
#ifdef with_parallel
#include <palpate/parallel/on_cores.hpp>

#include <atomic>
#endif
#ifdef with_vtk
#include <palpate/vtk/read_mesh.hpp>

#include <fstream>
#endif

namespace {

bool near(double value, double expected) { return std::abs(value - expected) < 1e-12; }

}  // namespace

int main() {
  bool right = true;
  auto const plate = palpate::make_grid<double>(3, 3, 0.5);
  right = right && near(palpate::surface_area(plate), 1.0);

#ifdef with_collision
  // A ball of 0.1 m radius, 0.3 m above a plate.
  palpate::FclSurface const surface(plate);
  double const distance = surface.distance(palpate::SphereTip<double>{0.1}, {0.5, 0.5, 0.3}).distance;
  std::printf("collision: distance %.3f m\n", distance);
  right = right && near(distance, 0.2);
#endif
#ifdef with_haply
  // The usual axes, right, up, towards the user, in those of the service; both libraries are within reach.
  auto const axes = palpate::signed_axes(palpate::Inverse3Options{}.axes);
  std::printf("haply: Beast %d\n", BOOST_BEAST_VERSION);
  right = right && axes && near((*axes)(2, 1), -1.0);
#endif
#ifdef with_json
  // The published loading curve, written and read.
  palpate::write_network("liver.json", palpate::liver_loading<double>());
  double const force = palpate::read_network<palpate::NetworkCurve<palpate::Network<double, 1, 5, 1>>>("liver.json")(0.015);
  std::printf("json: force %.4f N\n", force);
  right = right && std::abs(force - 0.1830) < 5e-5;
#endif
#ifdef with_network
  // The umbrella compiles; the library is within reach.
  std::printf("network: Asio %d\n", BOOST_ASIO_VERSION);
#endif
#ifdef with_parallel
  std::atomic<int> sum = 0;
  palpate::OnCores{2}(10, [&](int k) { sum += k; });
  std::printf("parallel: sum %d\n", sum.load());
  right = right && sum == 45;
#endif
#ifdef with_vtk
  // A triangle of 30 mm x 40 mm.
  std::ofstream("triangle.obj") << "v 0 0 0\nv 30 0 0\nv 0 40 0\nf 1 2 3\n";
  double const area = palpate::surface_area(palpate::read_mesh<double>("triangle.obj", 1e-3));
  std::printf("vtk: area %.6f m2\n", area);
  right = right && std::abs(area - 0.0006) < 1e-9;
#endif
  return right ? 0 : 1;
}
