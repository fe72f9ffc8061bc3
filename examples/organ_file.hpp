// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/units.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/vtk/read_mesh.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>

/// What the programs share that take an organ from a file.
namespace organ_file {

/// A closed surface [m] from a file in this unit. What has one right correction is corrected, which goes to standard error in one line; else it is
/// refused. Throws palpate::Error, also for an extent that no organ has: a file in another unit.
inline palpate::TriangleMesh<double> read_organ(char const* program, std::filesystem::path const& file, std::string const& unit) {
  using palpate::detail::message;
  std::string const name = file.string();
  auto mesh = palpate::read_mesh<double>(file, palpate::metres_per(unit));
  palpate::RepairReport const report = palpate::repair(mesh, {.wanted = {.closed = true}});
  if (!report.sound()) {
    // The telling defect first: a fin leaves holes too, and holes are what a file that was cut short looks like.
    using Kind = palpate::MeshDefectKind;
    auto worst = report.left.begin();
    for (Kind const kind : {Kind::open_border, Kind::non_manifold_edge}) {
      auto const found = std::find_if(report.left.begin(), report.left.end(), [&](auto const& defect) { return defect.kind == kind; });
      if (found != report.left.end()) worst = found;
    }
    bool const open = worst->kind == Kind::open_border;
    auto const others = report.left.size() - 1;
    throw palpate::InvalidMesh(message(name, ": ", to_string(*worst), open ? "; was the file cut short?" : "",
                                       others == 0 ? std::string() : message(" (and ", others, others == 1 ? " more defect)" : " more defects)")));
  }
  double const extent = (mesh.points.rowwise().maxCoeff() - mesh.points.rowwise().minCoeff()).norm();
  if (!palpate::organ_extent.contains(extent))
    throw palpate::InvalidMesh(message(name, ": with --unit ", unit, " the organ's diagonal is ",
                                       palpate::unlikely_length(extent / palpate::metres_per(unit), unit, palpate::organ_extent),
                                       "; say with --unit what the file is written in"));
  if (report.changed()) std::fprintf(stderr, "%s: %s: repaired: %s\n", program, name.c_str(), to_string(report).c_str());
  return mesh;
}

}  // namespace organ_file
