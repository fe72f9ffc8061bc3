// SPDX-License-Identifier: MIT
#pragma once

#include "stroke_case.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

/// Strokes out of any bytes, for a fuzzer: all bytes mean something, and small changes of them change the strokes a little.
///
///   byte 0   mesh           byte 1   snap          byte 2   0: the body rests; else it steps, or several blades, or few crossings a tick
///   then five bytes a tick: what it does, and its four numbers
///   0 … 31     the blade is lifted; a new stroke begins
///   32 … 95    to a vertex, exactly                         96 … 127   to a point of an edge
///   128 … 159  to a point of a triangle                     160 … 223  a little on, in the direction and as far as the numbers say
///   224 … 239  the same point at another height             240 … 255  the same point once more
/// The numbers of a triangle are those of the mesh undeformed and uncut.
template <class S>
StrokeCase<S> strokes_from_bytes(std::span<std::uint8_t const> bytes, std::size_t max_ticks = 60) {
  static constexpr std::array meshes{"small grid", "small sphere", "small tube", "small uneven"};
  auto const next = [&] {
    if (bytes.empty()) return 0;
    int const byte = bytes.front();
    bytes = bytes.subspan(1);
    return byte;
  };
  StrokeCase<S> strokes;
  strokes.mesh = meshes[static_cast<std::size_t>(next()) % meshes.size()];
  StrokeScene<S> const& scene = stroke_scene<S>(strokes.mesh);
  auto const& mesh = scene.mesh;
  if (int const snap = next(); snap >= 128) strokes.snap = scene.edge * S(snap - 128) / 200;
  int const kind = next();
  strokes.steps = kind >= 192 ? 1 : 0;
  strokes.blades = kind % 4 == 3 ? max_blades : 1;
  if (kind % 8 >= 6) strokes.crossings = 1 + kind / 8 % 4;
  auto const normals = palpate::vertex_normals(mesh);
  palpate::Vector3<S> at = mesh.points.col(0), normal = normals.col(0);
  S depth = S(0.4) * scene.edge;
  auto const place = [&](int t, S u, S v, S w) {
    auto const c = mesh.triangles.col(t % mesh.triangles.cols());
    at = u * mesh.points.col(c[0]) + v * mesh.points.col(c[1]) + w * mesh.points.col(c[2]);
    normal = (u * normals.col(c[0]) + v * normals.col(c[1]) + w * normals.col(c[2])).normalized();
  };
  auto const lift = [&] {
    if (!strokes.strokes.empty() && !strokes.strokes.back().empty()) strokes.strokes.back().push_back(at + scene.edge * normal / 2);
  };
  for (std::size_t tick = 0; tick < max_ticks && !bytes.empty(); ++tick) {
    int const what = next(), a = next(), b = next(), c = next(), d = next();
    S const s = S(b) / 255, r = S(c) / 255;
    if (what < 32) {
      lift();
      strokes.strokes.emplace_back();
      depth = S(0.4) * scene.edge;
      continue;
    }
    if (what < 96) {
      std::array<S, 3> w{};
      w[static_cast<std::size_t>(b % 3)] = 1;
      place(a, w[0], w[1], w[2]);
    } else if (what < 128) {
      place(a, 1 - s, s, S(0));
    } else if (what < 160) {
      S const u = 1 - s, v = s * (1 - r);
      place(a, u, v, 1 - u - v);
    } else if (what < 224) {   // 8 bits of size, 3 × 8 of direction
      palpate::Vector3<S> const way(S(b - 128) / 128, S(c - 128) / 128, S(d - 128) / 128);
      at += scene.edge * std::exp(S(a - 230) / 25) * (way - way.dot(normal) * normal);
    } else if (what < 240) {
      depth = scene.edge * S(a - 100) / 200;
    }
    if (strokes.strokes.empty()) strokes.strokes.emplace_back();
    auto& tips = strokes.strokes.back();
    if (tips.empty()) tips.push_back(at + scene.edge * normal / 2);
    tips.push_back(at - depth * normal);
  }
  lift();
  return strokes;
}
