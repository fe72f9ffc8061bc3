// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/pseudo_normal.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/units.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>

namespace palpate {

/// Where and how deep a tool tip is in contact with a soft body.
template <RealScalar Scalar>
struct SurfaceContact {
  bool touching = false;
  bool off_surface = false;   ///< the tip is beside the surface: beyond its border, or over an open wound
  int triangle = -1;
  Vector3<Scalar> barycentric = Vector3<Scalar>::Zero();
  Vector3<Scalar> point = Vector3<Scalar>::Zero();         ///< the touched point on the body as it is now [m]
  Vector3<Scalar> home_point = Vector3<Scalar>::Zero();    ///< the same point of the undisturbed body [m]
  Vector3<Scalar> normal = Vector3<Scalar>::UnitZ();       ///< smooth outward unit normal there, of the undisturbed body
  Scalar depth = 0;                                        ///< of the tip below the undisturbed surface, along the normal [m]

  /// Moves it to a point of a triangle, for a tip of this radius.
  template <class Body>
  void place(Body const& body, int at, Vector3<Scalar> const& weights, Vector3<Scalar> const& tip, Scalar radius) {
    auto const corners = body.tissue().surface().corners(at);
    triangle = at, barycentric = weights;
    point.setZero(), home_point.setZero();
    Vector3<Scalar> sum = Vector3<Scalar>::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      Scalar const w = weights[static_cast<int>(k)];
      point += w * body.positions().col(corners[k]);
      home_point += w * body.reference_position(corners[k]);
      sum += w * body.reference_normal(corners[k]);
    }
    if (sum.squaredNorm() > 0) normal = sum.normalized();
    depth = radius - (tip - home_point).dot(normal);
  }
};

/// Follows a spherical tool tip on a soft body that deforms.
/// Contact begins when the tip comes from outside onto the surface as it is now; a tip that starts behind the surface touches nothing
/// until it has been in front of it. A tip that passes a thin part within a tick touches the side it came from. From then on the touched point is where the line through the tip along the normal meets
/// the surface, found by walking from triangle to triangle, so that it never jumps to another part of the body. Only where a wound
/// or a border stops the walk, or tissue that is turned over, the surface around the last touched point is searched. What is found
/// has to be near it in the undisturbed body too, and look the same way; else the contact stays where it was.
/// Contact ends when the tip is above the surface, both as it is now and undisturbed, and where the body is restored under the tip:
/// then the tip has to come from outside again. It ends too when the tip is farther from the touched point than the undisturbed body's bounding box is long; and a
/// blade's, kept beside the surface, when the tip has come out of a closed body on a side that looks the other way. A blade of which more than the tip was in is kept
/// in contact, wherever its tip is out, until all of it is out.
///   depth = r − (tip − home point)·n
/// Units      m.
/// Source     \cite zheng2006 ch. 4, indentation depth.
/// Cost       in contact O(triangles walked over); without contact, and beside the surface, one search of the body's tree, which is fitted anew
///            where the body has moved. No allocation.
template <RealScalar Scalar>
class Touch {
  struct Never {
    bool operator()() const noexcept { return false; }
  };

 public:
  using Vector = Vector3<Scalar>;

  Touch() = default;
  explicit Touch(Scalar tip_radius) : radius_(tip_radius) {
    detail::require_non_negative("the tip radius", tip_radius, "m");
    require_length("the tip radius", static_cast<double>(tip_radius), tool_radius);
  }

  SurfaceContact<Scalar> const& contact() const noexcept { return contact_; }
  Scalar tip_radius() const noexcept { return radius_; }   // m
  /// The triangle that is touched, or was the nearest when the tip was seen outside last; −1: none. Edits may have given its number away since.
  int nearest_triangle() const noexcept { return contact_.touching ? contact_.triangle : front_; }

  /// Moves the tip [m]. Beside the surface the contact ends, or, with `keep_beside`, stays at the last point on it; `stays_in()` is asked then where the tip has come
  /// out, whether the rest of the blade is in the tissue.
  /// A tip that is not finite changes nothing.
  template <class Body, class StaysIn = Never>
  SurfaceContact<Scalar> const& update(Body& body, Vector const& tip, bool keep_beside = false, StaysIn const& stays_in = {}) {
    if constexpr (detail::can_act_on<Body>()) {
      static_assert(std::same_as<Scalar, typename Body::Scalar>, "Touch: it computes in another scalar than the body; take Touch<float> for a body in float.");
      if constexpr (std::same_as<Scalar, typename Body::Scalar>) move(body, tip, keep_beside, stays_in);
    }
    return contact_;
  }

  /// The tip has come in beside the surface: the contact begins at this point of it.
  template <class Body>
  void begin_at(Body& body, SurfacePoint<Scalar> const& at, Vector const& tip) {
    contact_ = {};
    touch(body, at, tip);
    follow(body, tip);
    last_tip_ = tip;
    remember(body);
  }

  /// Tells that triangles were edited: finds the touched point anew, from this triangle on.
  template <class Body>
  void restart_from(Body& body, int triangle, Vector const& tip) {
    contact_.triangle = triangle;
    contact_.barycentric.setConstant(Scalar(1) / 3);
    follow(body, tip);
    remember(body);
  }

  /// Whether the body was restored since the last update, or is, in contact, another one with fewer edits: the triangle that was touched may not exist
  /// any more.
  template <class Body>
  bool was_restored(Body const& body) const noexcept {
    return restorations_ != body.restorations() || (contact_.touching && body.topology_revision() < revision_);
  }

  /// The body was restored to how it was when this was copied: the contact is as it was then.
  template <class Body>
  void resume(Body const& body) noexcept {
    restorations_ = body.restorations();
  }

  /// Forgets the contact and where the tip was.
  void reset() noexcept { end(); }

 private:
  template <class Body, class StaysIn>
  void move(Body& body, Vector const& tip, bool keep_beside, StaysIn const& stays_in) {
    if (!is_finite(tip)) return;
    if (was_restored(body)) end(), revision_ = body.topology_revision();
    restorations_ = body.restorations();
    if (contact_.touching && !is_still_there(body) && !find_again(body)) end();
    if (contact_.touching) {
      follow(body, tip);
      if (contact_.off_surface && !keep_beside) end();
      if (contact_.touching && (tip - contact_.point).norm() > longest_)
        end();
      else if (contact_.touching && keep_beside && has_passed_through(body, tip, stays_in))
        last_tip_ = tip;
      if (contact_.touching && contact_.depth <= 0 && is_above(tip) && !(keep_beside && stays_in())) {
        int const left_from = contact_.triangle;
        end();
        outside_ = true;
        front_ = left_from;
      }
    } else {
      begin(body, tip);
    }
    last_tip_ = tip;
    remember(body);
  }

  template <class Body>
  void remember(Body const& body) noexcept {
    revision_ = body.topology_revision();
  }

  /// Whether the triangle with the last number holds the last touched point, or is beside it: another tool's edits may have given the number away.
  template <class Body>
  bool is_still_there(Body const& body) const {
    if (revision_ == body.topology_revision()) return true;
    if (contact_.triangle >= body.tissue().surface().triangle_count()) return false;
    auto const c = body.tissue().surface().corners(contact_.triangle);
    Scalar longest = 0;   // squared
    for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, (body.reference_position(c[k]) - body.reference_position(c[(k + 1) % 3])).squaredNorm());
    return (body.reference_position(c[0]) - contact_.home_point).squaredNorm() <= longest;
  }

  /// The triangle that was touched is gone, one that another tool's temporary particle had made, or with tissue that was taken away: the contact is where the last
  /// touched point was. False where there is none.
  template <class Body>
  bool find_again(Body& body) {
    SurfacePoint<Scalar> const nearest = body.nearest_point(contact_.point);
    contact_.triangle = nearest.triangle;
    contact_.barycentric = nearest.barycentric;
    return nearest.found();
  }

  void end() noexcept {
    contact_ = {};
    outside_ = false;
    front_ = -1;
  }

  bool is_above(Vector const& tip) const noexcept { return (tip - contact_.point).dot(contact_.normal) > radius_; }

  template <class Body>
  void begin(Body& body, Vector const& tip) {
    SurfacePoint<Scalar> const nearest = body.nearest_point(tip, front_);
    if (!nearest.found()) return;
    Vector const offset = tip - nearest.point;
    bool on_border = false;
    Vector const normal = detail::pseudo_normal(body, nearest.triangle, nearest.barycentric, on_border);
    Scalar const above = offset.dot(normal);
    bool const beside = on_border && std::abs(above) < Scalar(0.999) * offset.norm();
    Scalar const distance = (above < 0 ? -offset.norm() : offset.norm()) - radius_;
    if (beside) {
      outside_ = distance > 0 && above > 0;
      front_ = nearest.triangle;
      return;
    }
    bool const has_front = front_ >= 0 && front_ < body.tissue().surface().triangle_count();
    if (outside_ && has_front && detail::facet_normal(body, front_).dot(normal) < 0) {   // now nearest to a side that looks the other way
      if (begin_in_front(body, tip)) return;
      if (distance <= 0 && !((last_tip_ - nearest.point).dot(normal) > 0)) return;   // the tip has not come through that side
    }
    if (distance > 0) {
      outside_ = true;
      front_ = nearest.triangle;
    } else if (outside_) {
      touch(body, nearest, tip);
      if (contact_.depth > 0) follow(body, tip);
    }
  }
  template <class Body>
  void touch(Body& body, SurfacePoint<Scalar> const& at, Vector const& tip) {
    contact_.touching = true;
    tip_on_surface_ = tip;
    measure(body);
    contact_.place(body, at.triangle, at.barycentric, tip, radius_);
  }

  /// What a contact that begins needs to know of the body: its longest diagonal.
  template <class Body>
  void measure(Body& body) {
    longest_ = body.home_diagonal();
    clear_ = 0, is_through_ = false;
  }

  /// Whether the tip has left a closed body on a side that looks the other way; then the contact ends, and the tip is outside. The tree
  /// is searched only when the tip has gone half as far as the surface was away, or a thousandth of the body; while the rest stays in, always.
  template <class Body, class StaysIn>
  bool has_passed_through(Body& body, Vector const& tip, StaysIn const& stays_in) {
    if ((tip - looked_from_).norm() < clear_ / 2) return false;
    SurfacePoint<Scalar> const nearest = body.nearest_point(tip, contact_.triangle);
    if (!nearest.found()) return false;
    Vector const offset = tip - nearest.point;
    looked_from_ = tip;
    clear_ = std::max(offset.norm(), longest_ / 500);
    bool on_border = false;
    Vector const normal = detail::pseudo_normal(body, nearest.triangle, nearest.barycentric, on_border);
    Scalar const above = offset.dot(normal);
    is_through_ = is_through_ && !(above < 0);
    if (!(above > radius_) || !(is_through_ || (!on_border && normal.dot(contact_.normal) < 0))) return false;
    if (stays_in()) {
      is_through_ = true, clear_ = 0;
      return false;
    }
    end();
    outside_ = true;
    front_ = nearest.triangle;
    return true;
  }

  /// Begins the contact on the side that the tip was in front of, if the tip has passed it.
  template <class Body>
  bool begin_in_front(Body& body, Vector const& tip) {
    int triangle = front_;
    Vector barycentric = Vector::Constant(Scalar(1) / 3);
    contact_.place(body, triangle, barycentric, tip, radius_);
    if (walk(body, tip, triangle, barycentric) == Walk::there) {
      contact_.place(body, triangle, barycentric, tip, radius_);
      contact_.touching = !is_above(tip);
      tip_on_surface_ = tip;
      measure(body);
    }
    if (!contact_.touching) contact_ = {};
    return contact_.touching;
  }

  /// Where a walk over the surface ended.
  enum class Walk { there, border, behind };

  /// Finds the triangle that the line through the tip along the normal meets: by walking from the last one; where a wound or a border
  /// lies in the way, from the surface nearest to the tip, seen at the level of the last touched point. A triangle that belongs to another
  /// part of the body is not taken: from above a border the tip is then beside the surface, else the contact stays where it was.
  template <class Body>
  void follow(Body& body, Vector const& tip) {
    contact_.off_surface = false;
    int triangle = contact_.triangle;
    Vector barycentric = contact_.barycentric;
    bool stays = false;
    Vector const& n = contact_.normal;
    Walk first = walk(body, tip, triangle, barycentric);
    if (first == Walk::there && !looks_as_before(body, triangle, barycentric)) first = Walk::behind;
    if (first != Walk::there) {
      SurfacePoint<Scalar> const nearest = body.nearest_point(tip + (contact_.point - tip).dot(n) * n, triangle);
      int other = nearest.triangle;
      Vector weights = nearest.barycentric;
      if (nearest.found() && walk(body, tip, other, weights) == Walk::there && looks_as_before(body, other, weights) &&
          is_near(body, other, weights, tip))
        triangle = other, barycentric = weights;
      else if (first == Walk::border)
        contact_.off_surface = true;
      else
        triangle = contact_.triangle, barycentric = contact_.barycentric, stays = true;   // seen from behind: stay where the contact was
    }
    if (!contact_.off_surface && !stays) tip_on_surface_ = tip;
    contact_.place(body, triangle, barycentric, tip, radius_);
  }

  /// Whether the undisturbed surface at a point looks to the side where the contact is.
  template <class Body>
  bool looks_as_before(Body const& body, int t, Vector const& w) const {
    auto const c = body.tissue().surface().corners(t);
    Vector normal = Vector::Zero();
    for (std::size_t k = 0; k < 3; ++k) normal += w[static_cast<int>(k)] * body.reference_normal(c[k]);
    return normal.dot(contact_.normal) > 0;
  }

  /// Whether a point is, in the undisturbed body, no farther from the last touched point than the tip has gone since it was on it: within
  /// twice that, for tissue that is pushed together, and an edge of both triangles.
  template <class Body>
  bool is_near(Body const& body, int t, Vector const& w, Vector const& tip) const {
    auto const c = body.tissue().surface().corners(t), last = body.tissue().surface().corners(contact_.triangle);
    Vector home = Vector::Zero();
    Scalar edge = 0, edge_before = 0;   // squared
    for (std::size_t k = 0; k < 3; ++k) {
      home += w[static_cast<int>(k)] * body.reference_position(c[k]);
      edge = std::max(edge, (body.reference_position(c[k]) - body.reference_position(c[(k + 1) % 3])).squaredNorm());
      edge_before = std::max(edge_before, (body.reference_position(last[k]) - body.reference_position(last[(k + 1) % 3])).squaredNorm());
    }
    return (home - contact_.home_point).norm() <= 2 * (tip - tip_on_surface_).norm() + std::sqrt(edge) + std::sqrt(edge_before);
  }

  /// Walks from `t` towards the line through the tip along the normal. At a border: the nearest point of the last edge.
  template <class Body>
  Walk walk(Body const& body, Vector const& tip, int& t, Vector& w) const {
    constexpr Scalar slack = 64 * std::numeric_limits<Scalar>::epsilon();
    auto const& surface = body.tissue().surface();
    auto const x = body.positions();
    Vector const n = contact_.normal;
    for (int walked = 0; walked < 1000; ++walked) {
      auto const c = surface.corners(t);
      std::array<Vector, 3> const d{x.col(c[0]) - tip, x.col(c[1]) - tip, x.col(c[2]) - tip};
      w = Vector(n.dot(d[1].cross(d[2])), n.dot(d[2].cross(d[0])), n.dot(d[0].cross(d[1])));
      Scalar const sum = w.sum();
      if (!(sum > 0)) return Walk::behind;
      if (w.minCoeff() >= -slack * sum) {
        w = w.cwiseMax(Scalar(0));
        w /= w.sum();
        return Walk::there;
      }
      std::array<std::size_t, 3> order{0, 1, 2};   // across the edge that the line is farthest beyond, if there is a triangle
      std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return w[static_cast<int>(i)] < w[static_cast<int>(j)]; });
      int next = -1;
      for (std::size_t const k : order)
        if (next < 0 && w[static_cast<int>(k)] < 0) next = body.triangle_across(c[(k + 1) % 3], c[(k + 2) % 3]);
      if (next < 0) {
        auto const a = (order[0] + 1) % 3, b = (order[0] + 2) % 3;
        Vector const edge = d[b] - d[a];
        Vector const across = edge - edge.dot(n) * n;
        Scalar const s = std::clamp(-d[a].dot(across) / across.squaredNorm(), Scalar(0), Scalar(1));
        w.setZero();
        w[static_cast<int>(a)] = 1 - s;
        w[static_cast<int>(b)] = s;
        return Walk::border;
      }
      t = next;
    }
    return Walk::behind;
  }

  SurfaceContact<Scalar> contact_;
  Scalar radius_ = 0;
  Vector last_tip_ = Vector::Zero();
  Vector looked_from_ = Vector::Zero();      // where the tip was when the other side was last looked for
  Scalar clear_ = 0;                         // m, how far any surface was from it
  Scalar longest_ = 0;                       // m, diagonal of the undisturbed body
  Vector tip_on_surface_ = Vector::Zero();   // where the tip was when the touched point was last under it
  bool outside_ = false;
  bool is_through_ = false;                  // the tip has come out on another side, and the rest stays in
  std::size_t restorations_ = 0, revision_ = 0;   // of the body, when it was last seen
  int front_ = -1;                 // the triangle that the tip was nearest to when it was outside
};

}  // namespace palpate
