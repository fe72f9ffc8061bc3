// Two hooks hold the tissue open while a scalpel cuts between them: three tools, three hands, one simulator.
#include <palpate/palpate.hpp>
#include <palpate/tool.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

int main() {
  using namespace palpate;

  TetrahedralMesh<double> const block = make_block<double>(17, 11, 5, 0.005, BlockPattern::alternating);   // 3,200 tetrahedra
  FiniteElements<double, StableNeoHookean<double>> tissue(block, {.density = 1060.0, .material = {.young = 1e4, .poisson = 0.4}});
  tissue.nail(vertices_where(block, [](Vector3<double> const& p) { return p.z() < 1e-9; }));

  // A path of poses: where the tool's tip is, when.
  auto const pull = [](double side) {
    return ScriptedDevice<double>({{0.0, {0.04 + side * 0.004, 0.025, 0.030}}, {0.5, {0.04 + side * 0.004, 0.025, 0.017}}, {1.5, {0.04 + side * 0.010, 0.025, 0.017}}, {4.0, {0.04 + side * 0.010, 0.025, 0.017}}});
  };
  ScriptedDevice<double> const stroke({{0.0, {0.0413, 0.010, 0.040}}, {1.5, {0.0413, 0.010, 0.040}}, {2.0, {0.0413, 0.010, 0.012}}, {3.5, {0.0413, 0.040, 0.012}}, {4.0, {0.0413, 0.040, 0.040}}});

  Simulator simulator(SoftBody(std::move(tissue), BackwardEuler{}),
                      Tool(pull(-1.0), Hook<double>({.friction = 0.5}), TissueReaction{}),
                      Tool(pull(+1.0), Hook<double>({.friction = 0.5}), TissueReaction{}),
                      Tool(stroke, Scalpel<double>({.puncture_depth = 0.003}, {.shape = {.edge = 0.03, .angle = std::numbers::pi / 2}}), CuttingForce(liver_hysteresis<double>())));
  ToolRecordings const session = simulator.run(4.0);

  std::printf("tools %zu, both hooks pull outwards: %s\n", session.recordings().size(),
              session.recording(0).mean_force(1.0, 1.5).x() > 0 && session.recording(1).mean_force(1.0, 1.5).x() < 0 ? "yes" : "no");
  std::printf("cut opened: %s, mass kept: %s\n", simulator.tool<2>().report().lip_area > 1e-4 ? "yes" : "no",
              std::abs(simulator.body().total_mass() - 1060.0 * volume(block)) < 1e-9 ? "yes" : "no");
}
