// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/device/detail/csv_table.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate {

/// Where something is and how fast it moves: m, m/s.
template <RealScalar Scalar>
struct Motion {
  Vector3<Scalar> position = Vector3<Scalar>::Zero();
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();
};

/// Where something has to be, and when: s, m.
template <RealScalar Scalar>
struct TimedPoint {
  double time = 0;
  Vector3<Scalar> point = Vector3<Scalar>::Zero();
};

/// How the time of a piece is spread over its path, s(τ) with τ and s from 0 to 1.
///   constant       s = τ: the speed jumps at the ends
///   minimum_jerk   s = 10 τ³ − 15 τ⁴ + 6 τ⁵: speed and acceleration vanish at the ends, as in a reaching hand (\cite flash1985)
enum class Pace { constant, minimum_jerk };

/// A path in time, put together from pieces:
///
///   auto const stroke = Trajectory<double>::start({0, 0, 0.01}).line({0, 0, -0.01}, 1.0).hold(0.5).line({0.04, 0, -0.01}, 2.0);
///   Motion<double> const now = stroke.at(1.2);
///
/// Each piece begins where the one before ended, so the path never jumps; a speed may, where two pieces meet, and there `at`
/// gives the later one. Before the start and from the end on the path rests.
/// Units      points [m], world frame; times [s], in double for every Scalar, because a float loses the millisecond after hours.
/// Errors     `InvalidArgument` for a duration that is not positive or a point that is not finite; the path is then unchanged.
/// Cost       `at` is O(log pieces), noexcept, no allocation: allowed in the servo tick.
template <RealScalar Scalar>
class Trajectory {
 public:
  using Point = Vector3<Scalar>;

  /// A path that begins, and so far stays, at this point.
  static Trajectory start(Point const& point) {
    require_finite("start", point);
    return Trajectory(point);
  }
  /// A path through these points, straight and evenly from one to the next; before the first time it rests there.
  static Trajectory through(std::span<TimedPoint<Scalar> const> points) {
    if (points.empty()) throw InvalidArgument("through: no points; a path needs at least one");
    Trajectory path = start(points[0].point);
    double time = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      double const next = points[k].time;
      if (!(k == 0 ? next >= 0 : next > time) || !std::isfinite(next))
        throw InvalidArgument(detail::message("through: point ", k, " has the time ", next, " s; times are finite, from 0 on, and rise"));
      if (k > 0)
        path.line(points[k].point, next - time);
      else if (next > 0)
        path.hold(next);
      time = next;
    }
    return path;
  }
  /// A path from a CSV file; see `read_trajectory` below.
  static Trajectory from_csv(std::filesystem::path const& path);

  /// Stays for that long.
  Trajectory& hold(double seconds) & {
    return add({.kind = Kind::hold, .duration = seconds, .origin = end_, .end = end_}, "hold");
  }
  /// Straight to `point`.
  Trajectory& line(Point const& point, double seconds, Pace pace = Pace::constant) & {
    require_finite("line", point);
    return add({.kind = Kind::line, .pace = pace, .duration = seconds, .origin = end_, .a = point - end_, .end = point}, "line");
  }
  /// Around the axis through `centre`, by `angle` [rad], counter-clockwise seen against the axis; several turns are allowed.
  Trajectory& arc(Point const& centre, Point const& axis, Scalar angle, double seconds, Pace pace = Pace::constant) & {
    require_finite("arc", centre);
    require_finite("arc", axis);
    if (!std::isfinite(angle)) throw InvalidArgument(detail::message("arc: the angle is ", angle, " rad; give a finite one"));
    Scalar const length = stable_norm(axis);
    if (!(length > Scalar(0))) throw InvalidArgument("arc: the axis is zero and has no direction; give one, for example {0, 0, 1}");
    Point const unit = axis / length;
    Point const along = unit * unit.dot(end_ - centre);
    // Position: origin + cos(φ) a + sin(φ) b. The plane through the present end is turned, whatever the height of `centre`.
    Piece piece{.kind = Kind::arc, .pace = pace, .duration = seconds, .origin = centre + along, .a = end_ - centre - along,
                .angle = angle};
    piece.b = unit.cross(piece.a);
    piece.end = piece.origin + std::cos(angle) * piece.a + std::sin(angle) * piece.b;
    return add(piece, "arc");
  }
  /// Out by `reach` [m] and back, `times` times within `seconds`, starting and ending at rest: p + reach (1 − cos 2πτ)/2.
  Trajectory& tap(Point const& reach, double seconds, int times = 1) & {
    require_finite("tap", reach);
    if (times < 1) throw InvalidArgument(detail::message("tap: ", times, " times; give 1 or more"));
    return add({.kind = Kind::tap, .duration = seconds, .origin = end_, .a = reach,
                .angle = static_cast<Scalar>(2.0 * std::numbers::pi * times), .end = end_}, "tap");
  }
  /// Swings through p + reach sin φ(t), φ = 2π (f t + (g − f) t²/(2 T)): the frequency goes evenly from `from` to `to` [Hz] in T = `seconds`. It
  /// begins with its full speed, and the path goes on from where it ends.
  Trajectory& chirp(Point const& reach, double from, double to, double seconds) & { return swing("chirp", reach, from, to, seconds); }
  /// The same at one frequency [Hz].
  Trajectory& sine(Point const& reach, double frequency, double seconds) & { return swing("sine", reach, frequency, frequency, seconds); }
  /// Another path, from where this one ends. It has to begin there, to within a micrometre or the rounding of the coordinates.
  Trajectory& then(Trajectory const& next) & {
    Scalar const gap = (next.begin_ - end_).norm();
    Scalar const tolerance = Scalar(1e-6) + Scalar(8) * std::numeric_limits<Scalar>::epsilon() * end_.norm();
    if (!(gap <= tolerance))
      throw InvalidArgument(detail::message("then: the next path begins ", gap, " m from the end of this one; join them with line() "
                                            "first, or move it with moved()"));
    std::size_t const count = next.pieces_.size();   // `next` may be this very path
    pieces_.reserve(pieces_.size() + count);
    ends_.reserve(pieces_.size() + count);
    for (std::size_t i = 0; i < count; ++i) {
      Piece const piece = next.pieces_[i];
      add(piece, "then");
    }
    return *this;
  }

  Trajectory hold(double seconds) && { return std::move(hold(seconds)); }
  Trajectory line(Point const& point, double seconds, Pace pace = Pace::constant) && {
    return std::move(line(point, seconds, pace));
  }
  Trajectory arc(Point const& centre, Point const& axis, Scalar angle, double seconds, Pace pace = Pace::constant) && {
    return std::move(arc(centre, axis, angle, seconds, pace));
  }
  Trajectory tap(Point const& reach, double seconds, int times = 1) && { return std::move(tap(reach, seconds, times)); }
  Trajectory chirp(Point const& reach, double from, double to, double seconds) && { return std::move(chirp(reach, from, to, seconds)); }
  Trajectory sine(Point const& reach, double frequency, double seconds) && { return std::move(sine(reach, frequency, seconds)); }
  Trajectory then(Trajectory const& next) && { return std::move(then(next)); }

  /// The same path turned about the world's origin, then shifted: to lay a stroke drawn in the plane onto an organ.
  Trajectory moved(Matrix<Scalar, 3, 3> const& rotation, Point const& shift) const {
    Trajectory result(*this);
    auto const placed = [&](Point const& point) -> Point { return rotation * point + shift; };
    result.begin_ = placed(begin_);
    result.end_ = placed(end_);
    for (Piece& piece : result.pieces_) {
      piece.origin = placed(piece.origin);
      piece.end = placed(piece.end);
      piece.a = (rotation * piece.a).eval();
      piece.b = (rotation * piece.b).eval();
    }
    return result;
  }
  Trajectory moved(Point const& shift) const { return moved(Matrix<Scalar, 3, 3>::Identity(), shift); }

  /// s, the sum of all pieces.
  double duration() const noexcept { return ends_.empty() ? 0.0 : ends_.back(); }
  Point const& begin() const noexcept { return begin_; }
  Point const& end() const noexcept { return end_; }

  /// Position and its exact time derivative.
  Motion<Scalar> at(double time) const noexcept {
    if (!(time >= 0.0)) return {.position = begin_};
    if (time >= duration()) return {.position = end_};
    auto const index = static_cast<std::size_t>(std::upper_bound(ends_.begin(), ends_.end(), time) - ends_.begin());
    Piece const& piece = pieces_[index];
    double const begins = index == 0 ? 0.0 : ends_[index - 1];
    return piece.at((time - begins) / (ends_[index] - begins));
  }

 private:
  enum class Kind { hold, line, arc, tap, swing };

  struct Piece {
    Kind kind;
    Pace pace = Pace::constant;
    double duration;                 // s
    Point origin = Point::Zero();    // where it begins; for an arc its centre, in the plane of the circle
    Point a = Point::Zero();         // line: to the end; tap, swing: reach; arc: radius at the beginning
    Point b = Point::Zero();         // arc: a, turned by 90°
    Scalar angle = 0;                // arc, tap: rad in all
    double frequency = 0.0;          // swing: Hz, at the beginning
    double sweep = 0.0;              // swing: Hz/s
    Point end = Point::Zero();

    Motion<Scalar> at(double tau) const noexcept {
      if (kind == Kind::swing) {   // in double: a float loses the angle of the thousandth turn
        double const t = tau * duration, turn = 2.0 * std::numbers::pi;
        double const phase = turn * std::remainder(t * (frequency + sweep * t / 2.0), 1.0), speed = turn * (frequency + sweep * t);
        return {origin + static_cast<Scalar>(std::sin(phase)) * a, static_cast<Scalar>(speed * std::cos(phase)) * a};
      }
      double share = tau;
      double rate = 1.0 / duration;   // ds/dt
      if (pace == Pace::minimum_jerk) {
        share = tau * tau * tau * (10.0 + tau * (6.0 * tau - 15.0));
        double const rest = tau * (1.0 - tau);
        rate *= 30.0 * rest * rest;
      }
      Scalar const s = static_cast<Scalar>(share);
      Scalar const ds = static_cast<Scalar>(rate);
      Scalar const phase = angle * s;
      switch (kind) {
        case Kind::hold:
        case Kind::swing: break;
        case Kind::line: return {origin + s * a, ds * a};
        case Kind::arc:
          return {origin + std::cos(phase) * a + std::sin(phase) * b,
                  (ds * angle) * (std::cos(phase) * b - std::sin(phase) * a)};
        case Kind::tap:
          return {origin + (Scalar(0.5) * (Scalar(1) - std::cos(phase))) * a,
                  (Scalar(0.5) * ds * angle * std::sin(phase)) * a};
      }
      return {.position = origin};
    }
  };

  explicit Trajectory(Point const& point) : begin_(point), end_(point) {}

  Trajectory& swing(char const* what, Point const& reach, double from, double to, double seconds) {
    require_finite(what, reach);
    if (!(from >= 0.0) || !(to >= 0.0) || !std::isfinite(from) || !std::isfinite(to))
      throw InvalidArgument(detail::message(what, ": it goes from ", from, " to ", to, " Hz; give finite frequencies, zero or more"));
    Piece piece{.kind = Kind::swing, .duration = seconds, .origin = end_, .a = reach, .frequency = from, .sweep = (to - from) / seconds};
    piece.end = piece.at(1.0).position;
    return add(piece, what);
  }

  Trajectory& add(Piece const& piece, char const* what) {
    double const until = duration() + piece.duration;
    if (!(piece.duration > 0.0) || !std::isfinite(until))
      throw InvalidArgument(detail::message(what, ": it takes ", piece.duration, " s; give a positive, finite time"));
    if (!(until > duration()))
      throw InvalidArgument(detail::message(what, ": ", piece.duration, " s vanish beside the ", duration(), " s before"));
    if (!is_finite(piece.end)) throw InvalidArgument(detail::message(what, ": its end is no finite point; give lower frequencies or a shorter time"));
    ends_.reserve(pieces_.size() + 1 > ends_.capacity() ? 2 * ends_.capacity() + 8 : ends_.capacity());
    pieces_.push_back(piece);
    ends_.push_back(until);   // can not fail: there is room
    end_ = piece.end;
    return *this;
  }

  static void require_finite(char const* what, Point const& point) {
    if (!is_finite(point))
      throw InvalidArgument(detail::message(what, ": the point (", point.x(), ", ", point.y(), ", ", point.z(),
                                            ") is not finite; give metres in the world frame"));
  }

  Point begin_;
  Point end_;
  std::vector<Piece> pieces_;
  std::vector<double> ends_;   // s, when each piece ends
};

/// A tool path from a CSV file, straight from row to row.
/// Columns    time_s and x_m, y_m, z_m, or tip_x_m, tip_y_m, tip_z_m as in a recording; found by name, others are not looked at.
///            Time counts from the first row. Blank lines and lines that begin with # are skipped.
/// Errors     `FileError` with the line for a file that is missing or empty, a column that is missing, a cell that is not a
///            finite number, a time that does not grow, a speed that is none, a line cut short, fewer than two rows.
template <RealScalar Scalar>
Trajectory<Scalar> read_trajectory(std::filesystem::path const& path) {
  using detail::message;
  detail::CsvTable table(path);
  detail::CsvTable::Row row;
  if (!table.next(row)) table.fail("the file is empty; the first line must name the columns: time_s,x_m,y_m,z_m");

  std::string found;
  for (std::string_view const cell : row) (found += found.empty() ? "" : ", ") += cell;
  std::size_t const width = row.size();
  auto const find = [&](std::string_view name) {
    return static_cast<std::size_t>(std::find(row.begin(), row.end(), name) - row.begin());
  };
  bool const recorded = find("x_m") == width && find("tip_x_m") != width;
  std::string_view const names[4] = {"time_s", recorded ? "tip_x_m" : "x_m", recorded ? "tip_y_m" : "y_m",
                                     recorded ? "tip_z_m" : "z_m"};
  std::size_t columns[4];
  for (int i = 0; i < 4; ++i) {
    columns[i] = find(names[i]);
    if (columns[i] == width)
      table.fail_here(message("there is no column ", names[i], "; found: ", detail::legible(found),
                              "; the first line must name time_s,x_m,y_m,z_m (seconds and metres, separated by commas)"));
  }

  double first = 0.0;
  double last = 0.0;
  int rows = 0;
  Trajectory<Scalar> trajectory = Trajectory<Scalar>::start(Vector3<Scalar>::Zero());
  while (table.next(row)) {
    if (row.size() != width)
      table.fail_here(message("there are ", row.size(), " cells where the first line names ", width,
                              " columns; the file may be cut short"));
    double values[4];
    for (int i = 0; i < 4; ++i) {
      values[i] = table.number(row, columns[i], names[i]);
      if (!std::isfinite(static_cast<Scalar>(values[i])))
        table.fail_here(message("column ", names[i], " holds \"", row[columns[i]], "\"; every value must be finite"));
    }
    Vector3<Scalar> const point = Vector3<double>(values[1], values[2], values[3]).template cast<Scalar>();
    if (rows == 0) {
      first = values[0];
      trajectory = Trajectory<Scalar>::start(point);
    } else {
      double const elapsed = values[0] - first;
      if (!(values[0] > last) || !(elapsed > trajectory.duration()) || !std::isfinite(elapsed))
        table.fail_here(message("time_s is ", row[columns[0]], " after ", last, "; times must grow from row to row: sort the "
                                "rows and remove repeated ones"));
      if (Scalar const seconds = static_cast<Scalar>(elapsed - trajectory.duration()); !is_finite(Vector3<Scalar>((point - trajectory.end()) / seconds)))
        table.fail_here(message("the way from the row before, in ", seconds, " s, is too fast to be a number; give metres and seconds"));
      trajectory.line(point, elapsed - trajectory.duration());
    }
    last = values[0];
    ++rows;
  }
  if (rows < 2) table.fail(message("there are ", rows, " rows of numbers; a path needs two or more"));
  return trajectory;
}

template <RealScalar Scalar>
Trajectory<Scalar> Trajectory<Scalar>::from_csv(std::filesystem::path const& path) {
  return read_trajectory<Scalar>(path);
}

/// Presses, slides and lifts: what a finger does to feel friction, and a blade to cut.
template <RealScalar Scalar>
struct SlideShape {
  Vector3<Scalar> down = {0, 0, Scalar(-0.002)};   ///< m, the way of the press; it is lifted by as much
  Vector3<Scalar> along = {Scalar(0.04), 0, 0};    ///< m
  double press_seconds = 0.5;                      ///< s, for the press, and again for the lift; both begin and end at rest
  double slide_seconds = 2.0;
  Pace pace = Pace::constant;                      ///< of the slide
};

/// The path, and a slide from where it ended.
template <RealScalar Scalar>
Trajectory<Scalar> slide(Trajectory<Scalar> path, SlideShape<Scalar> const& shape) {
  Vector3<Scalar> const pressed = path.end() + shape.down, slid = pressed + shape.along;
  path.line(pressed, shape.press_seconds, Pace::minimum_jerk).line(slid, shape.slide_seconds, shape.pace);
  path.line(slid - shape.down, shape.press_seconds, Pace::minimum_jerk);
  return path;
}

/// The path, and whole circles around the axis through `centre` from where it ended, counter-clockwise seen against the axis; negative turns go the
/// other way.
template <RealScalar Scalar>
Trajectory<Scalar> circle(Trajectory<Scalar> path, Vector3<Scalar> const& centre, Vector3<Scalar> const& axis, double seconds, int turns = 1,
                          Pace pace = Pace::constant) {
  if (turns == 0) throw InvalidArgument("circle: 0 turns; give 1 or more, or -1 or less to go the other way");
  path.arc(centre, axis, static_cast<Scalar>(2.0 * std::numbers::pi * turns), seconds, pace);
  return path;
}

/// The path, and a few strokes there and back by `reach`, each way in `seconds`, resting at both ends: what measures hysteresis.
template <RealScalar Scalar>
Trajectory<Scalar> strokes(Trajectory<Scalar> path, Vector3<Scalar> const& reach, double seconds, int times = 1, Pace pace = Pace::minimum_jerk) {
  if (times < 1) throw InvalidArgument(detail::message("strokes: ", times, " times; give 1 or more"));
  Vector3<Scalar> const here = path.end();
  for (int k = 0; k < times; ++k) path.line(here + reach, seconds, pace).line(here, seconds, pace);
  return path;
}

}  // namespace palpate
