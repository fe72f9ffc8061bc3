// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/pseudo_normal.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// A point of a blade and the tetrahedron that carries it: x = Σ w_k x_k + offset. Outside the tissue some of the weights are negative, or the offset is not zero.
struct BladeSample {
  double share = 0;   // along the blade: k + u on the piece from its point k to the next
  int tetrahedron = -1;
  std::array<double, 4> weights{};
  Vector3<double> offset = Vector3<double>::Zero();   // m, world
  bool leaves = false;   // from here to the next sample it is in the air, be it a wound narrower than half an edge

  bool is_inside() const noexcept {
    return is_zero(offset) && std::ranges::all_of(weights, [](double w) { return w >= -1e-9; });
  }
};

/// Where a blade goes through the tetrahedra of a solid: its points, and where it goes through their faces. Between two of those it is straight in the material
/// too, so that it is known exactly where it was when the tissue has moved.
/// Source     \cite bielser2000 keeps the blade so: its crossings in barycentric coordinates of faces, its tip in those of a tetrahedron.
/// Cost       O(log triangles + tetrahedra on the blade); memory is kept.
template <RealScalar Scalar>
class TracedBlade {
  using Vector = Vector3<double>;
  using Weights = std::array<double, 4>;

 public:
  std::span<BladeSample const> samples() const noexcept { return samples_; }
  bool empty() const noexcept { return samples_.empty(); }
  /// Whether any of it is in the tissue.
  bool is_inside() const noexcept { return is_inside_; }
  /// Of it that is in the tissue [m].
  double length_inside() const noexcept { return inside_; }
  void clear() noexcept { samples_.clear(), leaves_.clear(), is_inside_ = false, inside_ = 0; }

  /// Follows a blade from point to point through the body as it is now.
  template <class Body>
  void trace(Body& body, std::span<Vector3<Scalar> const> blade) {
    hint_ = is_inside_ ? some_inside() : -1;
    clear();
    for (std::size_t k = 0; k + 1 < blade.size(); ++k) trace_piece(body, blade[k], blade[k + 1], static_cast<double>(k));
    order_.clear();
    for (std::size_t i = 0; i < samples_.size(); ++i) order_.emplace_back(samples_[i].share, i);
    std::sort(order_.begin(), order_.end());
    sorted_.clear();
    for (auto const& [share, i] : order_) sorted_.push_back(samples_[i]);
    samples_.swap(sorted_);
    // Where it goes through an edge or a vertex there are several at one place.
    samples_.erase(std::unique(samples_.begin(), samples_.end(), [](BladeSample const& a, BladeSample const& b) { return b.share - a.share < 1e-7; }), samples_.end());
    for (double const share : leaves_) {
      auto const after = std::ranges::upper_bound(samples_, share, {}, &BladeSample::share);
      if (after != samples_.begin()) std::prev(after)->leaves = true;
    }
  }

  /// Whether any of a blade that is there is in the tissue: it goes through the border, or lies within.
  template <class Body>
  bool would_be_inside(Body& body, std::span<Vector3<Scalar> const> blade) {
    for (std::size_t k = 1; k < blade.size(); ++k)
      if (find_hits(body, blade[k - 1], blade[k]); !hits_.empty() || holding(body, blade[k - 1], blade[k]) >= 0) return true;
    return false;
  }
  /// Whether any of its points, half an edge apart, is between lips.
  template <class Body>
  bool would_be_between_lips(Body& body, std::span<Vector3<Scalar> const> blade, Scalar reach) {
    Scalar const edge = body.mean_edge();
    for (std::size_t k = 1; k < blade.size(); ++k) {
      Scalar const length = (blade[k] - blade[k - 1]).norm();
      for (Scalar way = 0; way <= length;) {
        Vector3<Scalar> const point = blade[k - 1] + way / length * (blade[k] - blade[k - 1]);
        auto const wall = body.nearest_point(point);
        if (is_between_lips(body, point, wall, reach)) return true;
        way += std::max(edge / 2, wall.distance - reach);   // no wall is nearer
      }
    }
    return false;
  }
  /// Whether a point is within so much of the wall of a wound, and within twice that of the wall of a wound opposite: walls that lie on each other are opposite, too.
  template <class Body>
  bool is_between_lips(Body& body, Vector3<Scalar> const& point, Scalar reach) {
    return is_between_lips(body, point, body.nearest_point(point), reach);
  }

  /// Puts the samples elsewhere, as the blade has come so far; each is carried by the tetrahedron that it is in, or by the last one on the way there.
  template <class Body>
  void put(Body const& body, std::span<Vector const> points) {
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      samples_[i].tetrahedron = near(body, samples_[i].tetrahedron, points[i]);
      samples_[i].weights = weights(corners(body, samples_[i].tetrahedron), points[i]), samples_[i].offset.setZero();
    }
  }

  /// Where a sample is, with the body as it is now.
  template <class Body>
  static Vector now(Body const& body, BladeSample const& sample) noexcept {
    return carried(body, sample, [&](int i) { return body.positions().col(i); });
  }
  /// Where it is in the undeformed solid.
  template <class Body>
  static Vector undeformed(Body const& body, BladeSample const& sample) noexcept {
    return carried(body, sample, [&](int i) { return body.tissue().rest_position(i); });
  }
  /// Where it would be now if it were so far off in the undeformed solid, carried by the same tetrahedron.
  template <class Body>
  static Vector now(Body const& body, BladeSample sample, Vector const& off) noexcept {
    auto const c = body.tissue().topology().corners(sample.tetrahedron);
    std::array<Vector, 4> x;
    for (std::size_t k = 0; k < 4; ++k) x[k] = body.tissue().rest_position(c[k]).template cast<double>();
    Weights const moved = weights(x, x[0] + off);
    for (std::size_t k = 0; k < 4; ++k) sample.weights[k] += moved[k] - (k == 0 ? 1 : 0);
    return now(body, sample);
  }

 private:
  template <class Body>
  bool is_between_lips(Body& body, Vector3<Scalar> const& point, SurfacePoint<Scalar> const& wall, Scalar reach) {
    if (!wall.found() || wall.distance > reach || !body.tissue().is_wound(wall.triangle)) return false;
    Vector3<Scalar> const out = facet_normal(body, wall.triangle).normalized();
    find_hits(body, point - reach / 4 * out, wall.point + 2 * reach * out);
    return std::ranges::any_of(hits_, [&](Hit const& hit) {   // one that looks back: the floor of a pit has notches, too
      return hit.enters && body.tissue().is_wound(hit.triangle) && facet_normal(body, hit.triangle).normalized().dot(out) < Scalar(-0.7);
    });
  }
  /// Of a point in a tetrahedron of these corners.
  static Weights weights(std::array<Vector, 4> const& c, Vector const& x) noexcept {
    Vector const a = c[1] - c[0], b = c[2] - c[0], d = c[3] - c[0], p = x - c[0];
    Vector const across = a.cross(b), over = p.cross(d);
    double const part = 1 / across.dot(d), one = -over.dot(b) * part, two = over.dot(a) * part, three = across.dot(p) * part;
    return {1 - one - two - three, one, two, three};
  }
  template <class Body, class PositionOf>
  static Vector carried(Body const& body, BladeSample const& sample, PositionOf const& position_of) noexcept {
    Vector x = sample.offset;
    auto const c = body.tissue().topology().corners(sample.tetrahedron);
    for (std::size_t k = 0; k < 4; ++k) x += sample.weights[k] * position_of(c[k]).template cast<double>();
    return x;
  }
  /// The tetrahedron that holds a point, or the last one on the way there.
  template <class Body>
  static int near(Body const& body, int t, Vector const& x) noexcept {
    auto const& solid = body.tissue().topology();
    for (int steps = 0; steps < 1000; ++steps) {
      Weights const w = weights(corners(body, t), x);
      auto const lowest = std::min_element(w.begin(), w.end());
      int const next = *lowest >= -1e-12 ? -1 : solid.neighbour(t, static_cast<int>(lowest - w.begin()));
      if (next < 0) break;
      t = next;
    }
    return t;
  }
  template <class Body>
  static bool holds(Body const& body, int t, Vector const& x) noexcept {
    return std::ranges::all_of(weights(corners(body, t), x), [](double w) { return w >= -1e-9; });
  }

  struct Hit {
    double u;
    int triangle;
    bool enters, done;
  };

  int some_inside() const noexcept {
    for (BladeSample const& sample : samples_)
      if (sample.is_inside()) return sample.tetrahedron;
    return -1;
  }

  template <class Body>
  static std::array<Vector, 4> corners(Body const& body, int t) noexcept {
    auto const c = body.tissue().topology().corners(t);
    std::array<Vector, 4> x;
    for (std::size_t k = 0; k < 4; ++k) x[k] = body.positions().col(c[k]).template cast<double>();
    return x;
  }
  template <class Body>
  void trace_piece(Body& body, Vector3<Scalar> const& from, Vector3<Scalar> const& to, double first) {
    Vector const p = from.template cast<double>(), q = to.template cast<double>();
    find_hits(body, from, to);
    within_.clear();
    auto const march = [&](int tetrahedron, int entered, double u, bool on) {
      add(body, p, q, first, tetrahedron, u);
      double const reached = go(body, p, q, first, tetrahedron, entered, u, on);
      within_.push_back(std::minmax(u, reached));
    };
    auto const from_hit = [&](Hit& hit, bool on) {
      hit.done = true;
      auto const [t, k] = body.tissue().topology().border_face(hit.triangle);
      march(t, k, hit.u, on);
    };
    for (Hit& hit : hits_)
      if (hit.enters && !hit.done) from_hit(hit, true);
    for (std::size_t k = hits_.size(); k-- > 0;)
      if (!hits_[k].enters && !hits_[k].done) from_hit(hits_[k], false);
    if (hits_.empty())
      if (int const t = holding(body, from, to); t >= 0) march(t, -1, 0, true);
    is_inside_ = is_inside_ || !within_.empty();
    std::sort(within_.begin(), within_.end());
    double begin = 0;
    for (auto const& [enters, leaves] : within_) {
      if (begin < enters) add_in_air(body, p, q, first, begin, enters);
      if (enters - begin >= 1e-7) leaves_.push_back(first + begin);
      begin = std::max(begin, leaves);
    }
    if (begin < 1) add_in_air(body, p, q, first, begin, 1);
  }

  /// A part of the piece in the air: its points go with what is nearest, half an edge from each other near the tissue, and turn with it where they are next to it.
  template <class Body>
  void add_in_air(Body& body, Vector const& p, Vector const& q, double first, double begin, double end) {
    double const edge = static_cast<double>(body.mean_edge()), length = (q - p).norm();
    int likely = hits_.empty() ? -1 : hits_.front().triangle;
    for (double u = begin;;) {
      Vector const x = p + u * (q - p);
      auto const foot = body.nearest_point(x.template cast<Scalar>(), likely);
      if (!foot.found()) return;
      likely = foot.triangle;
      if (u == 0 || u == 1 || (u > begin && u < end)) {
        int const t = body.tissue().topology().border_face(foot.triangle).tetrahedron;
        Weights const w = weights(corners(body, t), x);
        if (std::ranges::all_of(w, [](double weight) { return std::abs(weight) < 4; })) {
          samples_.push_back({first + u, t, w, Vector::Zero()});
        } else {
          Vector const point = foot.point.template cast<double>();
          samples_.push_back({first + u, t, weights(corners(body, t), point), x - point});
        }
      }
      if (!(u < end)) return;
      u = std::min(end, u + std::max(edge / 2, static_cast<double>(foot.distance) - edge) / length);
    }
  }

  /// Where the piece goes through the border, in order.
  template <class Body>
  void find_hits(Body& body, Vector3<Scalar> const& from, Vector3<Scalar> const& to) {
    hits_.clear();
    Vector const p = from.template cast<double>(), way = (to - from).template cast<double>();
    body.visit_triangles_along(from, to, [&](int triangle) {
      auto const c = body.tissue().surface().corners(triangle);
      std::array<Vector, 3> x;
      for (std::size_t k = 0; k < 3; ++k) x[k] = body.positions().col(c[k]).template cast<double>();
      Vector const a = x[1] - x[0], b = x[2] - x[0], normal = a.cross(b), off = p - x[0];
      double const along = -normal.dot(way);   // positive into the tissue
      if (!(std::abs(along) > 1e-14 * normal.norm() * way.norm())) return;
      Vector const turned = off.cross(way);
      double const u = normal.dot(off) / along, one = b.dot(turned) / along, two = -a.dot(turned) / along, digits = 1e-12;
      if (u >= 0 && u <= 1 && one >= -digits && two >= -digits && one + two <= 1 + digits) hits_.push_back({u, triangle, along > 0, false});
    });
    std::sort(hits_.begin(), hits_.end(), [](Hit const& a, Hit const& b) { return a.u < b.u || (a.u == b.u && a.triangle < b.triangle); });
    auto const& surface = body.tissue().surface();
    auto const is_same = [&](Hit const& a, Hit const& b) {   // through an edge or a vertex
      return a.enters == b.enters && b.u - a.u <= 1e-12 && std::ranges::any_of(surface.corners(a.triangle), [&](int v) { return surface.corner_of(b.triangle, v) >= 0; });
    };
    hits_.erase(std::unique(hits_.begin(), hits_.end(), is_same), hits_.end());
  }

  template <class Body>
  void add(Body const& body, Vector const& p, Vector const& q, double first, int t, double u) {
    samples_.push_back({first + u, t, weights(corners(body, t), p + u * (q - p)), Vector::Zero()});
  }

  /// Goes through the tetrahedra, on or back along the piece, with a sample at each face, until its end or the border. Returns how far.
  template <class Body>
  double go(Body const& body, Vector const& p, Vector const& q, double first, int t, int entered, double u, bool on) {
    auto const& solid = body.tissue().topology();
    double const begun = u;
    for (int steps = 0; steps < 100000; ++steps) {
      auto const x = corners(body, t);
      Weights const at_p = weights(x, p), at_q = weights(x, q);
      int leaves = -1;
      double next = on ? 1 : 0;
      for (int k = 0; k < 4; ++k) {
        auto const i = static_cast<std::size_t>(k);
        double const falls = on ? at_p[i] - at_q[i] : at_q[i] - at_p[i];
        if (k == entered || !(falls > 0)) continue;
        double const zero = at_p[i] / (at_p[i] - at_q[i]);
        if (on ? zero < next : zero > next) next = zero, leaves = k;
      }
      if (leaves < 0) {
        add(body, p, q, first, t, next);
        u = next;
        break;
      }
      u = on ? std::max(u, next) : std::min(u, next);
      add(body, p, q, first, t, u);
      int const beyond = solid.neighbour(t, leaves);
      if (beyond < 0) {
        int const triangle = solid.border_triangle(t, leaves);
        for (Hit& hit : hits_)
          if (hit.triangle == triangle) hit.done = true;
        break;
      }
      entered = -1;
      for (int k = 0; k < 4; ++k)
        if (solid.neighbour(beyond, k) == t) entered = k;
      t = beyond;
    }
    inside_ += std::abs(u - begun) * (q - p).norm();
    return u;
  }

  /// The tetrahedron that holds the first point of a piece that does not go through the border, or −1. Where the walls of a wound lie on each other, or in one
  /// another, the nearest may be the wrong one: there by the line of the piece, straight back from where it comes out of the tissue.
  template <class Body>
  int holding(Body& body, Vector3<Scalar> const& from, Vector3<Scalar> const& to) {
    Vector const p = from.template cast<double>();
    auto const& solid = body.tissue().topology();
    auto const foot = body.nearest_point(from);
    for (int const start : {hint_, foot.found() ? solid.border_face(foot.triangle).tetrahedron : -1}) {
      int const t = start >= 0 && start < solid.tetrahedron_count() ? near(body, start, p) : -1;
      if (t >= 0 && holds(body, t, p)) return t;
    }
    if (!foot.found() || !body.tissue().is_wound(foot.triangle)) return -1;
    int found = -1;
    for (Scalar const way : {Scalar(1), Scalar(-1)}) {
      if (found >= 0) break;
      Vector3<Scalar> const out = from + way * 2 * body.home_diagonal() * (to - from).normalized();
      find_hits(body, from, out);
      for (auto hit = hits_.begin(); found < 0 && hit != hits_.end(); ++hit)
        if (!hit->enters) found = straight_to(body, p, out.template cast<double>(), solid.border_face(hit->triangle).tetrahedron);
    }
    hits_.clear();
    return found;
  }
  /// The tetrahedron that holds x, on the straight way there from the one whose border face a point beyond sees; −1 where the border is in the way.
  template <class Body>
  static int straight_to(Body const& body, Vector const& x, Vector const& beyond, int t) noexcept {
    for (int steps = 0; t >= 0 && steps < 100000; ++steps) {
      auto const c = corners(body, t);
      Weights const here = weights(c, x), there = weights(c, beyond);
      if (std::ranges::all_of(here, [](double w) { return w >= -1e-9; })) return t;
      int leaves = -1;
      double farthest = -1;   // of the faces that look to x the first that is met from beyond, as a share of the way from x
      for (int k = 0; k < 4; ++k) {
        auto const i = static_cast<std::size_t>(k);
        if (!(here[i] < 0 && there[i] > here[i])) continue;
        if (double const share = here[i] / (here[i] - there[i]); share > farthest) farthest = share, leaves = k;
      }
      if (leaves < 0) return -1;
      t = body.tissue().topology().neighbour(t, leaves);
    }
    return -1;
  }

  std::vector<BladeSample> samples_, sorted_;
  std::vector<std::pair<double, std::size_t>> order_;   // of the samples, as they came
  std::vector<Hit> hits_;
  std::vector<std::pair<double, double>> within_;   // where a piece is in the tissue
  std::vector<double> leaves_;                      // shares at which the blade comes out of the tissue
  bool is_inside_ = false;
  double inside_ = 0;   // m
  int hint_ = -1;
};

}  // namespace palpate::detail
