// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/close_points.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/detail/surface_sides.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

struct RepairOptions {
  MeshRequirements wanted;   ///< what the mesh must be afterwards; its tolerance also decides what is merged and dropped
};

/// What `repair` changed, and what is left for a person to correct.
struct RepairReport {
  int merged_vertices = 0;
  int dropped_degenerate = 0;     ///< elements with a repeated corner, or without area or volume
  int flipped_edges = 0;          ///< a flat triangle and its neighbour that were cut the other way, so that no hole opens
  int dropped_duplicates = 0;     ///< elements
  int turned = 0;                 ///< triangles whose sense, tetrahedra whose sign was changed
  int dropped_unused = 0;         ///< vertices
  std::vector<int> new_index;     ///< per vertex of the mesh as it was: its index now, −1 where it was dropped
  std::vector<MeshDefect> left;   ///< what `validate` still finds

  bool sound() const noexcept { return left.empty(); }
  bool changed() const noexcept {
    return merged_vertices + dropped_degenerate + flipped_edges + dropped_duplicates + turned + dropped_unused > 0;
  }
};

/// One line for a log: "merged 3 duplicate vertices, dropped 1 unused vertex" or "nothing to repair", then what is left.
inline std::string to_string(RepairReport const& report) {
  std::string text;
  auto const add = [&](int count, char const* verb, char const* one, char const* many) {
    if (count > 0) text += detail::message(text.empty() ? "" : ", ", verb, " ", count, " ", count == 1 ? one : many);
  };
  add(report.merged_vertices, "merged", "duplicate vertex", "duplicate vertices");
  add(report.dropped_degenerate, "dropped", "degenerate element", "degenerate elements");
  add(report.flipped_edges, "flipped", "edge of a flat triangle", "edges of flat triangles");
  add(report.dropped_duplicates, "dropped", "duplicate element", "duplicate elements");
  add(report.turned, "turned", "element", "elements");
  add(report.dropped_unused, "dropped", "unused vertex", "unused vertices");
  if (text.empty()) text = report.left.empty() ? "nothing to repair" : "nothing repaired";
  if (report.left.empty()) return text;
  return text + detail::message("; ", report.left.size(), report.left.size() == 1 ? " defect is" : " defects are",
                                " left, the first: ", to_string(report.left.front()));
}

namespace detail {

template <int Corners>
bool in_range(Matrix<int, Corners, Dynamic> const& elements, Eigen::Index e, Eigen::Index vertices) {
  return elements.col(e).minCoeff() >= 0 && elements.col(e).maxCoeff() < vertices;
}

template <int Corners>
bool repeats_corner(Matrix<int, Corners, Dynamic> const& elements, Eigen::Index e) {
  for (int c = 0; c < Corners; ++c)
    for (int d = 0; d < c; ++d)
      if (elements(c, e) == elements(d, e)) return true;
  return false;
}

/// Keeps the elements for which keep[e], in their order; returns how many went.
template <int Corners>
int keep_elements(Matrix<int, Corners, Dynamic>& elements, std::vector<char> const& keep) {
  Eigen::Index kept = 0;
  for (Eigen::Index e = 0; e < elements.cols(); ++e)
    if (keep[static_cast<std::size_t>(e)]) {
      if (kept != e) elements.col(kept) = elements.col(e).eval();
      ++kept;
    }
  int const gone = static_cast<int>(elements.cols() - kept);
  elements.conservativeResize(Eigen::NoChange, kept);
  return gone;
}

template <SimplexMesh Mesh>
void merge_vertices(Mesh& mesh, MeshRequirements const& wanted, RepairReport& report) {
  auto& [points, elements] = mesh;
  report.new_index.resize(static_cast<std::size_t>(points.cols()));
  std::iota(report.new_index.begin(), report.new_index.end(), 0);
  if (!wanted.distinct_points) return;
  report.new_index = first_close_point(points, wanted.tolerance * median_side(points, elements));
  for (int v = 0; v < static_cast<int>(points.cols()); ++v)
    report.merged_vertices += report.new_index[static_cast<std::size_t>(v)] != v;
  for (int& v : elements.reshaped())
    if (v >= 0 && v < points.cols()) v = report.new_index[static_cast<std::size_t>(v)];
}

/// Drops the vertices of no element and numbers the rest without gaps. `report.new_index` maps to the merged vertices so far.
template <SimplexMesh Mesh>
void drop_unused(Mesh& mesh, bool drop, RepairReport& report) {
  auto& [points, elements] = mesh;
  std::vector<int> name(static_cast<std::size_t>(points.cols()), drop ? -1 : 0);
  for (int const v : elements.reshaped())
    if (v >= 0 && v < points.cols()) name[static_cast<std::size_t>(v)] = 0;
  for (std::size_t v = 0; v < name.size(); ++v)   // a merged vertex goes with or without elements, and is counted as merged
    if (report.new_index[v] != static_cast<int>(v)) name[v] = -1;
  int next = 0;
  for (std::size_t v = 0; v < name.size(); ++v) {
    if (name[v] < 0) {
      report.dropped_unused += report.new_index[v] == static_cast<int>(v);
      continue;
    }
    points.col(next) = points.col(static_cast<Eigen::Index>(v)).eval();
    name[v] = next++;
  }
  Eigen::Index const before = points.cols();
  for (int& v : elements.reshaped())
    if (v >= 0 && v < before) v = name[static_cast<std::size_t>(v)];
    else if (v >= before) v = static_cast<int>(next + (v - before));   // stays as far out of range as it was
  points.conservativeResize(Eigen::NoChange, next);
  for (int& v : report.new_index) v = name[static_cast<std::size_t>(v)];
}

template <RealScalar Scalar>
double flatness_of(TriangleMesh<Scalar> const& mesh, Eigen::Index t) {
  return flatness(mesh.points.col(mesh.triangles(0, t)).template cast<double>(),
                  mesh.points.col(mesh.triangles(1, t)).template cast<double>(),
                  mesh.points.col(mesh.triangles(2, t)).template cast<double>());
}

/// Triangles without area whose three corners are apart lie with their middle corner on their longest side. Where exactly one
/// other triangle shares that side, both are cut the other way: dropping the flat one would leave a slit. Else it is dropped.
template <RealScalar Scalar>
void remove_flat_triangles(TriangleMesh<Scalar>& mesh, double tolerance, RepairReport& report) {
  auto const count = static_cast<std::size_t>(mesh.triangles.cols());
  std::vector<char> keep(count, 1), readable(count, 1), flat(count, 0);
  auto const look = [&](int t) {
    std::size_t const i = static_cast<std::size_t>(t);
    readable[i] = keep[i] && in_range(mesh.triangles, t, mesh.points.cols());
    for (int c = 0; c < 3 && readable[i]; ++c) readable[i] = is_finite(mesh.points.col(mesh.triangles(c, t)));
    flat[i] = readable[i] && flatness_of(mesh, t) <= tolerance;
  };
  for (int t = 0; t < static_cast<int>(count); ++t) look(t);
  for (int pass = 0; pass < 20 && std::count(flat.begin(), flat.end(), char{1}) > 0; ++pass) {
    auto const sides =
        sorted_sides(mesh.triangles, [&](int t) { return keep[static_cast<std::size_t>(t)] && readable[static_cast<std::size_t>(t)]; });
    auto const on_edge = [&](std::uint64_t key) {
      return std::equal_range(sides.begin(), sides.end(), Side{key, 0, false},
                              [](Side const& a, Side const& b) { return a.edge < b.edge; });
    };
    std::vector<char> touched(count, 0);
    int flips = 0;
    for (int t = 0; t < static_cast<int>(count); ++t) {
      if (!flat[static_cast<std::size_t>(t)] || touched[static_cast<std::size_t>(t)]) continue;
      int longest = 0;
      double length = -1;
      for (int c = 0; c < 3; ++c)
        if (double const l = (mesh.points.col(mesh.triangles((c + 1) % 3, t)).template cast<double>() -
                              mesh.points.col(mesh.triangles(c, t)).template cast<double>()).norm(); l > length)
          longest = c, length = l;
      int const a = mesh.triangles(longest, t), b = mesh.triangles((longest + 1) % 3, t),
                c = mesh.triangles((longest + 2) % 3, t);
      auto const [first, last] = on_edge(edge_key(a, b));
      if (last - first != 2) continue;
      Side const other = first->corner / 3 == t ? *(first + 1) : *first;
      int const o = other.corner / 3, d = mesh.triangles((other.corner % 3 + 2) % 3, o);
      auto const [cd_first, cd_last] = on_edge(edge_key(c, d));
      if (o == t || c == d || cd_first != cd_last || touched[static_cast<std::size_t>(o)]) continue;
      mesh.triangles.col(t) << a, d, c;
      mesh.triangles.col(o) << d, b, c;
      if (other.rising == (a < b)) {   // the neighbour ran a → b as well: it is the one that has a sense
        std::swap(mesh.triangles(1, t), mesh.triangles(2, t));
        std::swap(mesh.triangles(1, o), mesh.triangles(2, o));
      }
      touched[static_cast<std::size_t>(t)] = touched[static_cast<std::size_t>(o)] = 1;
      look(t), look(o);
      ++flips;
    }
    report.flipped_edges += flips;
    if (flips == 0) break;
  }
  for (std::size_t t = 0; t < count; ++t) keep[t] = !flat[t];
  report.dropped_degenerate += keep_elements(mesh.triangles, keep);
}

/// Turns triangles so that neighbours agree and closed pieces face outward; an open piece keeps the sense of most of it.
template <RealScalar Scalar>
void orient(TriangleMesh<Scalar>& mesh, RepairReport& report) {
  int const count = static_cast<int>(mesh.triangles.cols());
  std::vector<char> sound(static_cast<std::size_t>(count), 1);
  for (int t = 0; t < count; ++t) sound[static_cast<std::size_t>(t)] = in_range(mesh.triangles, t, mesh.points.cols());
  auto const sides = sorted_sides(mesh.triangles, [&](int t) { return sound[static_cast<std::size_t>(t)] != 0; });
  std::vector<std::array<int, 3>> neighbour(static_cast<std::size_t>(count), {-1, -1, -1});   // −2 − t: runs the same way
  std::vector<char> open(static_cast<std::size_t>(count), 0);
  for_each_edge(sides, [&](Side const* first, Side const* last) {
    if (last - first != 2) {
      for (auto const* s = first; s < last; ++s) open[static_cast<std::size_t>(s->corner / 3)] = 1;
      return;
    }
    bool const same = first[0].rising == first[1].rising;
    for (int i = 0; i < 2; ++i) {
      int const t = first[1 - i].corner / 3;
      neighbour[static_cast<std::size_t>(first[i].corner / 3)][static_cast<std::size_t>(first[i].corner % 3)] = same ? -2 - t : t;
    }
  });

  std::vector<int> sheet(static_cast<std::size_t>(count), -1);
  std::vector<char> turn(static_cast<std::size_t>(count), 0);
  std::vector<std::vector<int>> sheets;
  for (int start = 0; start < count; ++start) {
    if (!sound[static_cast<std::size_t>(start)] || sheet[static_cast<std::size_t>(start)] >= 0) continue;
    int const name = static_cast<int>(sheets.size());
    std::vector<int> members{start};
    sheet[static_cast<std::size_t>(start)] = name;
    std::size_t turned = 0;
    for (std::size_t i = 0; i < members.size(); ++i)
      for (int const n : neighbour[static_cast<std::size_t>(members[i])]) {
        if (n == -1) continue;
        int const u = n < 0 ? -2 - n : n;
        if (sheet[static_cast<std::size_t>(u)] >= 0) continue;
        sheet[static_cast<std::size_t>(u)] = name;
        char const own = turn[static_cast<std::size_t>(members[i])];
        turn[static_cast<std::size_t>(u)] = n < 0 ? !own : own;
        turned += turn[static_cast<std::size_t>(u)] != 0;
        members.push_back(u);
      }
    if (2 * turned > members.size())
      for (int const t : members) turn[static_cast<std::size_t>(t)] = !turn[static_cast<std::size_t>(t)];
    sheets.push_back(std::move(members));
  }
  auto const apply = [&](int t) {
    std::swap(mesh.triangles(1, t), mesh.triangles(2, t));
    turn[static_cast<std::size_t>(t)] = !turn[static_cast<std::size_t>(t)];
  };
  std::vector<char> const agreed = turn;
  std::fill(turn.begin(), turn.end(), char{0});
  for (int t = 0; t < count; ++t)
    if (agreed[static_cast<std::size_t>(t)]) apply(t);

  std::vector<Piece> closed;   // named by their sheet
  for (int s = 0; s < static_cast<int>(sheets.size()); ++s) {
    auto const& members = sheets[static_cast<std::size_t>(s)];
    bool whole = true;
    Piece piece(s, mesh, mesh.triangles(0, members[0]));
    for (int const t : members) {
      whole = whole && !open[static_cast<std::size_t>(t)];
      piece.add(mesh, t);
    }
    if (whole) closed.push_back(piece);
  }
  if (!closed.empty()) {
    auto const turn_sheet = [&](Piece& piece) {
      for (int const t : sheets[static_cast<std::size_t>(piece.name)]) apply(t);
      piece.volume = -piece.volume;
    };
    Piece& largest = *std::max_element(closed.begin(), closed.end(), [](Piece const& a, Piece const& b) {
      return std::abs(a.volume) < std::abs(b.volume);
    });
    if (largest.volume < 0) turn_sheet(largest);
    for (Piece& piece : closed)
      if (faces_inward(piece, largest)) turn_sheet(piece);
  }
  report.turned += static_cast<int>(std::count(turn.begin(), turn.end(), char{1}));
}

/// Drops later elements with the corners of an earlier one.
template <int Corners>
int drop_duplicates(Matrix<int, Corners, Dynamic>& elements) {
  auto const first = first_with_same_corners(elements, [](int) { return true; });
  std::vector<char> keep(first.size());
  for (std::size_t e = 0; e < first.size(); ++e) keep[e] = first[e] == static_cast<int>(e);
  return keep_elements(elements, keep);
}

template <int Corners>
int drop_repeated_corners(Matrix<int, Corners, Dynamic>& elements, Eigen::Index vertices) {
  std::vector<char> keep(static_cast<std::size_t>(elements.cols()));
  for (Eigen::Index e = 0; e < elements.cols(); ++e)
    keep[static_cast<std::size_t>(e)] = !in_range(elements, e, vertices) || !repeats_corner(elements, e);
  return keep_elements(elements, keep);
}

/// What comes after vertices are merged and elements with a repeated corner dropped.
template <RealScalar Scalar>
void repair_elements(TriangleMesh<Scalar>& mesh, double tolerance, RepairReport& report) {
  report.dropped_duplicates += drop_duplicates(mesh.triangles);
  remove_flat_triangles(mesh, tolerance, report);
  report.dropped_duplicates += drop_duplicates(mesh.triangles);
  orient(mesh, report);
}
template <RealScalar Scalar>
void repair_elements(TetrahedralMesh<Scalar>& mesh, double tolerance, RepairReport& report) {
  std::vector<char> keep(static_cast<std::size_t>(mesh.tetrahedra.cols()), 1);
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    if (!in_range(mesh.tetrahedra, t, mesh.points.cols())) continue;
    Matrix<double, 3, 4> p;
    for (int c = 0; c < 4; ++c) p.col(c) = mesh.points.col(mesh.tetrahedra(c, t)).template cast<double>();
    if (!is_finite(p)) continue;
    double const flat = flatness(p.col(0), p.col(1), p.col(2), p.col(3));
    if (std::abs(flat) <= tolerance) {
      keep[static_cast<std::size_t>(t)] = 0;
    } else if (flat < 0) {
      std::swap(mesh.tetrahedra(2, t), mesh.tetrahedra(3, t));
      ++report.turned;
    }
  }
  report.dropped_degenerate += keep_elements(mesh.tetrahedra, keep);
  report.dropped_duplicates += drop_duplicates(mesh.tetrahedra);
}

}  // namespace detail

/// Corrects a foreign surface where there is one right way to do it, in this order:
///   1. vertices at one place are merged (unless cut lips are wanted: `distinct_points = false`);
///   2. triangles that name a vertex twice are dropped; flat ones are removed without leaving a slit;
///   3. triangles with the corners of an earlier one are dropped;
///   4. triangles are turned so that neighbours agree and closed pieces face outward (walls of a cavity inward);
///   5. vertices of no triangle are dropped and the rest numbered without gaps, in their order.
/// What it can not correct stays as it is and is reported in `left`: coordinates that are not finite, indices out of range, more
/// than two triangles at an edge, fans that meet in a vertex, holes, one-sided surfaces. It never throws on a bad mesh.
/// Cost       O(m log m) for m triangles; a few seconds for a million.
/// Limits     Merging joins surfaces that only touch; a point used by no triangle but not finite is dropped like any other.
///
/// A foreign volume: vertices at one place are merged, tetrahedra without volume and repeated ones dropped, two corners of those inside out
/// swapped, unused vertices dropped. Tetrahedra that overlap stay, and are reported in `left`.
template <detail::SimplexMesh Mesh>
RepairReport repair(Mesh& mesh, RepairOptions const& options = {}) {
  RepairReport report;
  detail::merge_vertices(mesh, options.wanted, report);
  report.dropped_degenerate += detail::drop_repeated_corners(mesh.elements(), mesh.points.cols());
  detail::repair_elements(mesh, options.wanted.tolerance, report);
  detail::drop_unused(mesh, options.wanted.no_unused_points, report);
  report.left = validate(mesh, options.wanted);
  return report;
}

}  // namespace palpate
