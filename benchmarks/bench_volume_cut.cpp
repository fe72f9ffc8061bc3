// SPDX-License-Identifier: MIT
// A blade through a solid of finite elements or of springs: time for each tetrahedron that a cut makes, part by part; a tick with the blade inside that cuts
// nothing; and beside them, in the same run, gathering all packs anew, and making tissue and body from the mesh.
//   bench_volume_cut
#include <palpate/body/soft_body.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

double now() { return 1e6 * benchmarks::thread_time(); }   // µs
double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Finite elements that say how long their own part of a cut takes.
template <bool is_nodal>
class Elements : public FiniteElements<double, StableNeoHookean<double>> {
  using Solid = FiniteElements<double, StableNeoHookean<double>>;

 public:
  explicit Elements(int n)
      : Solid(make_block<double>(n, n, n, 0.005, BlockPattern::alternating),
              {.density = 1000.0, .material = {.young = 1e4, .poisson = 0.4}, .pressure = is_nodal ? Pressure::nodal : Pressure::element}) {}
  void finish_edits() {
    double const start = now();
    Solid::finish_edits();
    finishing += now() - start;
  }
  void follow_edits(std::span<int const> moving, Assembly& assembly) const {
    double const start = now();
    Solid::follow_edits(moving, assembly);
    *packing += now() - start;
  }

  double finishing = 0;                                                  // µs
  std::shared_ptr<double> packing = std::make_shared<double>(0.0);   // µs, of all copies
};
struct Springs {};

template <bool is_nodal>
auto make_body(std::type_identity<Elements<is_nodal>>, int n) {
  return SoftBody(Elements<is_nodal>(n), BackwardEuler{.max_iterations = 1});
}
auto make_body(std::type_identity<Springs>, int n) {
  return SoftBody(MassSpring<double>(make_block<double>(n, n, n, 0.005, BlockPattern::alternating), {.mass = {.total = 1e-4 * n * n * n}, .link = {.stiffness = 50.0}}),
                  LeapfrogVerlet{});
}

/// Argument: vertices along each side of the block. 60 % of it is cut through, 40 ticks an edge, 250 to 500 at most, down to 40 % of its height; a step after each tick.
///   us_each            of a tick, for each tetrahedron that it makes: cutter, topology, masses, border, search, neighbours; of this
///   us_each_finish     neighbours, row bounds, with nodal pressure its stars;
///   us_each_packs      in the step after it: packs that forces are computed in
///   us_each_warm       as us_each, of another body that is cut without a step between: caches are warm
///   us_packs_warm      beside it, packs that follow each of its ticks, beyond
///   us_packs_look      what they take to see that nothing has been cut: a look at each particle's number, once a step
///   us_idle_tick       of a tick that cuts nothing; and us_touch of a tip that presses the skin elsewhere, in the same ticks
///   ms_step, ms_step_after_cut, ms_packs_anew, ms_made_anew   a step (of elements implicit, of one iteration), one after a tick that cuts, gathering all packs, making body and tissue from the mesh
template <class Kind>
void cut_block(benchmark::State& state) {
  int const n = static_cast<int>(state.range(0));
  double const side = 0.005 * (n - 1);
  constexpr bool is_timed = !std::is_same_v<Kind, Springs>;
  for (auto _ : state) {
    double const start = now();
    auto body = make_body(std::type_identity<Kind>{}, n);
    double const made_in = now() - start;
    auto const& tissue = body.tissue();
    int const tetrahedra = tissue.topology().tetrahedron_count();
    body.reserve(body.size() + body.size() / 5, 20 * n * n);
    auto const finishing = [&] {
      if constexpr (is_timed)
        return tissue.finishing;
      else
        return 0.0;
    };
    auto const packing = [&] {
      if constexpr (is_timed)
        return *tissue.packing;
      else
        return 0.0;
    };
    auto const step = [&] {
      double const stepped_at = now();
      body.step(1e-6);
      return now() - stepped_at;
    };
    step();
    std::vector<double> each, warm, packs_warm, packs_look, finish, packs, idle, touching, steps, steps_after;
    VolumeCutter<double> knife, other;
    Touch<double> touch;
    touch.update(body, {side / 4, side / 4, side + 0.001});
    auto const cut = [&](auto& cut_body, VolumeCutter<double>& blade, int tick) {   // how long it takes, and how many it makes
      auto const& solid = cut_body.tissue().topology();
      double const y = -0.002 + 0.6 * side * tick / (40.0 * n);
      int const before = solid.tetrahedron_count();
      cut_body.nearest_vertex({side / 2, y, side});   // fits the search tree, as a tool that touches does
      double const cut_at = now();
      blade.advance(cut_body, {{side / 2 + 0.0013, y, 0.4 * side}, {side / 2 + 0.0013, y, side + 0.01}});
      return std::pair(now() - cut_at, solid.tetrahedron_count() - before);
    };
    int const ticks = std::min(40 * n, n > 24 ? 250 : 500);
    for (int tick = 0; tick <= ticks; ++tick) {
      double const finished = finishing(), packed = packing();
      auto const [took, made] = cut(body, knife, tick);
      double const touched_at = now();
      touch.update(body, {side / 4, side / 4 + 0.4 * side * tick / ticks, side - 0.0005});
      double const touched = now() - touched_at, stepped = step();
      if (made > 0)
        each.push_back(took / made), finish.push_back((finishing() - finished) / made), packs.push_back((packing() - packed) / made), steps_after.push_back(stepped);
      else
        idle.push_back(took), touching.push_back(touched), steps.push_back(stepped);
    }
    {
      auto again = make_body(std::type_identity<Kind>{}, n);
      again.reserve(again.size() + again.size() / 5, 20 * n * n);
      std::vector<int> chosen;
      typename std::remove_cvref_t<decltype(tissue)>::Assembly assembly;
      assembly.reserve(again.tissue(), again.size() + again.size() / 5, 0);
      auto const follow = [&] {
        while (static_cast<int>(chosen.size()) < again.size()) chosen.push_back(static_cast<int>(chosen.size()));
        double const followed_at = now();
        if constexpr (is_timed) again.tissue().follow_edits(chosen, assembly);
        return now() - followed_at;
      };
      follow();
      for (int tick = 0; tick <= ticks; ++tick)
        if (auto const [took, made] = cut(again, other, tick); made > 0) {
          double const followed = follow(), only_looked = follow();
          warm.push_back(took / made), packs_look.push_back(only_looked), packs_warm.push_back((followed - only_looked) / made);
        }
    }
    state.counters["tetrahedra"] = tetrahedra;
    state.counters["made"] = tissue.topology().tetrahedron_count() - tetrahedra;
    state.counters["us_each"] = median(std::move(each));
    state.counters["us_each_warm"] = median(std::move(warm));
    if (is_timed) {
      state.counters["us_packs_warm"] = median(std::move(packs_warm));
      state.counters["us_packs_look"] = median(std::move(packs_look));
      state.counters["us_each_finish"] = median(std::move(finish)), state.counters["us_each_packs"] = median(std::move(packs));
    }
    state.counters["us_idle_tick"] = median(std::move(idle)), state.counters["us_touch"] = median(std::move(touching));
    state.counters["ms_step"] = median(std::move(steps)) / 1e3;
    state.counters["ms_step_after_cut"] = median(std::move(steps_after)) / 1e3;
    std::vector<int> all(static_cast<std::size_t>(body.size()));
    std::iota(all.begin(), all.end(), 0);
    typename std::remove_cvref_t<decltype(tissue)>::Assembly assembly;
    tissue.assemble(all, assembly);
    double const packed_at = now();
    tissue.assemble(all, assembly);
    state.counters["ms_packs_anew"] = (now() - packed_at) / 1e3;
    state.counters["ms_made_anew"] = made_in / 1e3;
  }
}
BENCHMARK(cut_block<Elements<false>>)->Arg(6)->Arg(12)->Arg(24)->Arg(48)->Arg(59)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(cut_block<Elements<true>>)->Arg(6)->Arg(12)->Arg(24)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(cut_block<Springs>)->Arg(6)->Arg(12)->Arg(24)->Arg(48)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
