// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/cubes/cube_relaxation.hpp>
#include <palpate/tissue/cubes/cubes_options.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// Which vertices of a face get a force that acts on it.
enum class TouchSpread {
  nearest_vertex,   ///< all on one
  face_corners,     ///< on four, by distance: bilinear weights, so that force and moment are those of the touched point
};

/// A solid of cubes that share vertices, with springs along their edges and diagonals, brought towards rest by local relaxation: static, no inertia. The touched cube
/// is split and joined again; a cut detaches cubes from each other. A body of its own, for a Simulator and its tools as a SoftBody is.
///
///   Cubes body(make_organ<double>({.vertices = 2000}), {.edge = 0.01, .young = 5000.0, .levels = 1});
///   body.nail(0);
///   body.apply_force(body.nearest_vertex(tip), force);   // N, for the next step
///   body.step(1e-3);                                     // s
///   body.cut(from, to, from_now, to_now);                // m, a blade's edge that went from one place to another
///
/// Cubes      those of a grid whose middle is inside the surface, 3 × 3 × 3 points for 2 × 2 × 2 of them, no vertex twice. Touched, a cube becomes 8^levels: a force on
///            three of its vertices, as a tool's on a triangle of its skin, splits it after the step, and it is joined `join_after` steps after the last.
/// Springs    of each cube of edge s: 12 edges of 0.14 E s, 12 face and 4 space diagonals of 0.12 E s [N/m]; where cubes share two vertices theirs add up. From
///            C_ijkl = Σ k L² n_i n_j n_k n_l / s³: isotropic, λ = μ = 2 E/5, for small strains.
/// Hanging    a vertex in the middle of a larger cube's edge or face is where the mean of its 2 or 4 corners is, by distance, and what pulls it pulls
///            these by the same weights: no gap, and a uniform strain passes unchanged from large cubes to small ones.
/// Solution   x_i ← x_i + α F_i / k_i, one vertex after the other, F_i = Σ g_ij + f_i + m_i g − home spring, k_i a bound of ∂F_i/∂x_i in the rest shape,
///            and of springs longer than 1.5 times their own length their stiffness more, as these resist a move across them too: converges for α < 2 where
///            tissue is not pulled out far, for α < 2/3 always; for 1.2 in what was tried. Breadth first begins at the touched vertices; a sweep ends where
///            little is left to do, every eighth goes through the body.
/// Contact    predicted_acceleration() and mobility() are those of a body that gives 6/k_i per newton in a step and rests where last step's forces left it.
/// Units      m, N, Pa, kg/m³, s.
/// Shapes     positions(), velocities(): 3 × size(), vertices inside too. Those of unsplit cubes come first and keep their numbers; what a cut copies and a split
///            adds follows. Of the skin, triangles 2 f and 2 f + 1 begin the face f of an unsplit cube, whatever it is split into; the rest follows.
/// Errors     InvalidArgument for options and values, InvalidMesh for a surface that is open or holds no cube, OutOfRange for an index; the body stays as it was.
///            A step after which something is not finite is not taken: it reports that it diverged.
/// Source     \cite haaland. Errata: the static condition is printed Σg − f = 0; the algorithm's Σg + f is right. Ours: stiffness from Young's modulus, hanging vertices,
///            detaching across the blade alone, joining.
/// Cost       a visit of a vertex 56 springs. A split or join O(split cubes · 8^levels), no allocation up to touched_cubes of them; a cut that opens faces
///            O(cubes), and allocates.
/// Limits     a piece that nothing holds, nailed or supported nowhere, has no weight: it stays where it is, and a force moves it on by a share of F/k in each
///            step. Poisson's ratio 1/4. Smooth surfaces become steps of a cube. A split cube is split all through, its faces open as one. Vertices of split
///            cubes can not be nailed by themselves: they are where all corners around them are. A load on many vertices by apply_force() touches.
template <RealScalar ScalarType>
class Cubes : public detail::CubeRelaxation<ScalarType> {
  using Base = detail::CubeRelaxation<ScalarType>;

 public:
  using typename Base::Scalar, typename Base::Vector, typename Base::Options, typename Base::Report;
  using Base::size, Base::cubes, Base::apply_force;

  Cubes(TriangleMesh<Scalar> const& surface, Options const& options) : Base(surface, options) { begin(); }

  /// Adds a force at a point of the skin [N], on vertices of the face there; the cube counts as touched.
  void apply_force_at(SurfacePoint<Scalar> const& touched, Vector const& force, TouchSpread spread = TouchSpread::face_corners);

  /// h ≥ 0.
  Report step(Scalar h) {
    this->check_step(h);
    note_touched();
    Report const report = this->relax(options_.sweeps, options_.seconds, h > 0 ? 1 / h : Scalar(0), Base::quiet, false);
    if (options_.levels > 0) split_and_join();
    return report;
  }
  // --- splits and cuts ------------------------------------------------------------------------------------------------
  /// Splits a cube in 8^levels, as a touch does, or joins it. False where it is so already.
  bool split(int cube) { return set_split(cube, true); }
  bool join(int cube) { return set_split(cube, false); }
  /// A blade's edge went from a–b to c–d: opens each face between two cubes whose middles it came between. Returns how many.
  int cut(Vector const& a, Vector const& b, Vector const& c, Vector const& d) {
    return cut(a, b, c, d, [](int) { return Vector(Vector::Zero()); });
  }
  /// The same while the tissue moved: each cube's middle has come by moved(cube) [m] since the blade was at a–b.
  template <class Moved>
  int cut(Vector const& a, Vector const& b, Vector const& c, Vector const& d, Moved const& moved);
  /// m, where the middle of an unsplit cube is now.
  Vector middle(int cube) const noexcept {
    Vector sum = Vector::Zero();
    for (int const v : grid_.corners(cube)) sum += x_[v];
    return sum / 8;
  }
  /// As the source cuts: each cube around a vertex gets its own, so all faces there open, along the blade too. Returns how many.
  int detach(int vertex);

  // --- save and restore -----------------------------------------------------------------------------------------------
  /// Everything that makes the body's future.
  struct State {
    std::uint64_t grid;   // whose
    std::vector<int> opened, split, idle, hit, touches, touched, loaded, order;   // the last: where it is by chance
    Matrix3X<Scalar> u, v, load, pushed;
    typename Base::SkinState skin;
    std::vector<Scalar> support;
    Vector gravity;
    Random random;
    int sweep, levels;
    bool is_quiet, was_loaded;
    Scalar largest;
  };
  State save() const {
    return {grid_.mark(), grid_.opened(), fine_.cubes,    idle_,            hit_,     touches_, touched_, loaded_, this->options_.order == VisitOrder::random ? this->order_ : std::vector<int>(), u_.view(),  v_.view(),
            load_.view(),   pushed_.view(), this->save_skin(), support_, gravity_, random_,  sweep_,  this->options_.levels, is_quiet_, was_loaded_, largest_};
  }
  void restore(State const& state) {
    if (state.idle.size() != at(cubes()))
      throw InvalidArgument(detail::message("Cubes: a state of ", state.idle.size(), " cubes can not be restored in a body of ", cubes(), "; it is another body's"));
    if (state.grid != grid_.mark()) throw InvalidArgument("Cubes: a state of as many cubes that lie in another way can not be restored; it is another body's");
    if (state.levels != this->options_.levels)
      throw InvalidArgument(detail::message("Cubes: a state of a body that splits over ", state.levels, " levels can not be restored in one of ", this->options_.levels, "; it is another body's"));
    this->require_shape(state.skin);
    grid_.set_opened(state.opened);
    begin_anew();
    this->refine(state.split);
    idle_ = state.idle, hit_ = state.hit, touches_ = state.touches;
    v_.view() = state.v, load_.view() = state.load, pushed_.view() = state.pushed;
    support_ = state.support, gravity_ = state.gravity, random_ = state.random, touched_ = state.touched, loaded_ = state.loaded, sweep_ = state.sweep;
    for (int const i : loaded_) is_loaded_[at(i)] = 1;
    for (int i = 0; i < size(); ++i) this->displace(i, state.u.col(i)), this->refresh(i);
    this->begin_order();
    if (!state.order.empty()) this->order_ = state.order;
    is_quiet_ = state.is_quiet, was_loaded_ = state.was_loaded, largest_ = state.largest;
    this->restore_skin(state.skin);
  }

 private:
  using Base::at, Base::rest_, Base::x_, Base::u_, Base::v_, Base::grid_, Base::base_, Base::around_, Base::hang_, Base::slot_, Base::fine_, Base::options_, Base::load_,
      Base::pushed_, Base::support_, Base::loaded_, Base::touched_, Base::is_loaded_, Base::sweep_, Base::gravity_, Base::random_, Base::largest_, Base::is_quiet_,
      Base::was_loaded_;

  /// No cube has been touched.
  void begin() {
    idle_.assign(at(cubes()), 0), touches_.assign(at(cubes()), 0);
    hit_.clear(), hit_.reserve(at(cubes())), wanted_.reserve(at(this->max_split_) + 1);
  }
  void begin_anew() {
    Base::build(), Base::begin();
    begin();
  }
  void reopen();

  bool set_split(int cube, bool split) {
    this->check_cube(cube);
    if (split && options_.levels == 0) throw InvalidArgument(detail::message("cube ", cube, " is to be split, but options.levels is 0; give how often"));
    if ((slot_[at(cube)] >= 0) == split) return false;
    wanted_ = fine_.cubes;
    auto const place = std::lower_bound(wanted_.begin(), wanted_.end(), cube);
    if (split)
      wanted_.insert(place, cube), idle_[at(cube)] = 0;
    else
      wanted_.erase(place);
    this->refine(wanted_);
    return true;
  }
  /// Splits what the last step's forces touched, joins what they have left long ago.
  void split_and_join() {
    wanted_.clear();
    bool changes = false;
    for (int const c : fine_.cubes)
      if (touches_[at(c)] > 0 || ++idle_[at(c)] <= options_.join_after)
        wanted_.push_back(c);
      else
        changes = true;
    for (int const c : hit_) {
      idle_[at(c)] = 0;
      if (touches_[at(c)] >= 3) {
        if (slot_[at(c)] < 0) wanted_.insert(std::lower_bound(wanted_.begin(), wanted_.end(), c), c), changes = true;
      }
      touches_[at(c)] = 0;
    }
    hit_.clear();
    if (changes) this->refine(wanted_);
  }
  void touch(int cube, int times) {
    if (touches_[at(cube)] == 0) hit_.push_back(cube);
    touches_[at(cube)] += times;
  }
  /// Which cubes have felt three forces, as a tool's on the corners of a triangle.
  void note_touched() {
    if (options_.levels == 0) return;
    for (int const i : loaded_) {
      std::array<int, 8> done;
      auto end = done.begin();
      for (int const leaf : around_[at(i)]) {
        int const c = leaf >= 0 ? this->cube_of_leaf(leaf) : -1;
        if (c < 0 || std::find(done.begin(), end, c) != end) continue;
        *end++ = c;
        touch(c, 1);
      }
    }
  }

  std::vector<int> idle_, touches_;   // of each cube: steps since the last touch, touched vertices
  std::vector<int> hit_, wanted_;     // cubes that are touched, and to be split
};

template <RealScalar Scalar>
Cubes(TriangleMesh<Scalar> const&, CubesOptions<Scalar> const&) -> Cubes<Scalar>;

template <RealScalar Scalar>
void Cubes<Scalar>::apply_force_at(SurfacePoint<Scalar> const& touched, Vector const& force, TouchSpread spread) {
  int const cube = this->cube_of(touched.triangle);
  std::array<int, 4> const corners = this->square_of(touched.triangle);
  Vector home = Vector::Zero();
  for (int k = 0; k < 3; ++k) home += touched.barycentric[k] * rest_[this->tissue().surface().corners(touched.triangle)[at(k)]];
  if (spread == TouchSpread::nearest_vertex) {
    auto const nearer = [&](int a, int b) { return (rest_[a] - home).squaredNorm() < (rest_[b] - home).squaredNorm(); };
    apply_force(*std::min_element(corners.begin(), corners.end(), nearer), force);
  } else {
    Scalar const s = (rest_[corners[1]] - rest_[corners[0]]).norm();
    for (int const corner : corners)
      apply_force(corner, (1 - (home - rest_[corner]).cwiseAbs().array() / s).max(Scalar(0)).prod() * force);
  }
  if (options_.levels > 0) touch(cube, 3);
}

/// After faces were opened: all anew, with what moves, nails and pushes the vertices before.
template <RealScalar Scalar>
void Cubes<Scalar>::reopen() {
  this->give_loads_to_corners();
  State const last = save();
  std::vector<std::array<int, 8>> corners(at(cubes()));
  for (int c = 0; c < cubes(); ++c) corners[at(c)] = grid_.corners(c);
  auto const around = around_;
  auto const was_split = fine_;
  grid_.share_corners();
  begin_anew();
  // A vertex of unsplit cubes is a copy of the one that its cube had there; of split ones, cube and point tell which it was.
  auto const count = [](std::array<int, 8> const& leaves) { return std::count_if(leaves.begin(), leaves.end(), [](int leaf) { return leaf >= 0; }); };
  for (int i = 0; i < base_; ++i) {
    auto const [c, k] = grid_.first(i);
    int const from = corners[at(c)][at(k)];
    this->displace(i, last.u.col(from), last.v.col(from));
    if (last.skin.nailed[at(from)] != 0) this->mark_nailed(i);
    Scalar const share = Scalar(count(around_[at(i)])) / Scalar(count(around[at(from)]));
    load_[i] = share * last.load.col(from), pushed_[i] = share * last.pushed.col(from);
    if (load_[i] != Vector(Vector::Zero())) is_loaded_[at(i)] = 1, loaded_.push_back(i);
    support_[at(i)] = share * last.support[at(from)];
    this->refresh(i);
  }
  idle_ = last.idle, hit_ = last.hit, touches_ = last.touches;
  if (!was_split.cubes.empty()) {
    this->refine(was_split.cubes);
    for (std::size_t n = 0; n < fine_.vertex.size(); ++n)
      if (int const v = fine_.vertex[n], from = was_split.vertex[n]; v >= base_ && hang_[at(v)].count == 0) this->displace(v, last.u.col(from), last.v.col(from));
  }
  touched_ = last.touched;
  std::erase_if(touched_, [&](int i) { return i >= base_; });
  this->begin_order();
}

template <RealScalar Scalar>
template <class Moved>
int Cubes<Scalar>::cut(Vector const& a, Vector const& b, Vector const& c, Vector const& d, Moved const& moved) {
  for (Vector const& end : {a, b, c, d}) detail::require_finite("an end of the blade's edge", end, "m");
  auto const passes = [](Vector const& p, Vector const& q, Vector const& i, Vector const& j, Vector const& k) {
    Vector const normal = (j - i).cross(k - i);
    Scalar const at_p = normal.dot(p - i), at_q = normal.dot(q - i);
    if ((at_p > 0) == (at_q > 0)) return false;
    Vector const x = p + at_p / (at_p - at_q) * (q - p);
    Scalar const slack = Scalar(-1e-5) * normal.squaredNorm();
    return normal.dot((j - i).cross(x - i)) >= slack && normal.dot((k - j).cross(x - j)) >= slack && normal.dot((i - k).cross(x - k)) >= slack;
  };
  int opened = 0;
  for (int cube = 0; cube < cubes(); ++cube) {
    Vector const here = middle(cube);
    for (int side = 1; side < 6; side += 2) {
      int const next = grid_.linked(cube, side);
      if (next < 0) continue;
      Vector const there = middle(next), with = (moved(cube) + moved(next)) / 2, from = a + with, to = b + with;   // seen from the two cubes as they are now
      Vector const low = from.cwiseMin(to).cwiseMin(c).cwiseMin(d), high = from.cwiseMax(to).cwiseMax(c).cwiseMax(d);
      if ((here.cwiseMin(there) - high).maxCoeff() > 0 || (low - here.cwiseMax(there)).maxCoeff() > 0) continue;
      if (passes(here, there, from, to, d) || passes(here, there, from, d, c)) opened += grid_.open(cube, side);
    }
  }
  if (opened > 0) reopen();
  return opened;
}

template <RealScalar Scalar>
int Cubes<Scalar>::detach(int vertex) {
  this->check_own(vertex, "detached");
  int opened = 0;
  for (int c = 0; c < cubes(); ++c)
    for (int k = 0; k < 8; ++k)
      if (grid_.corners(c)[at(k)] == vertex)
        for (int axis = 0; axis < 3; ++axis) opened += grid_.open(c, 2 * axis + (k >> axis & 1));
  if (opened > 0) reopen();
  return opened;
}

}  // namespace palpate
