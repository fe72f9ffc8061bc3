// SPDX-License-Identifier: MIT
#include "problem.hpp"

#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>

#include <malloc.h>

#include <ctime>
#include <filesystem>
#include <fstream>

namespace models {

Problem::Problem()
    : skin(make_organ<double>({.vertices = 2000, .length = 0.1})), coarse(filled(*this, coarse_edge)), volume(palpate::volume(skin)), mass(density * volume) {
  Eigen::Index highest = 0;
  skin.points.row(2).maxCoeff(&highest);
  top = skin.points.col(highest);
  nailed_below = skin.points.row(2).minCoeff() + 0.015;
}

double processor_time() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
double megabytes_in_use() {
  auto const now = mallinfo2();
  return 1e-6 * static_cast<double>(now.uordblks + now.hblkhd);
}

/// Neither blank nor comment.
int code_lines(Headers const& headers) {
  int lines = 0;
  auto const add = [&](std::filesystem::path const& file) {
    std::ifstream in(file);
    if (!in) throw FileError(detail::message("can not read ", file.string(), " to count its lines"));
    for (std::string line; std::getline(in, line);) {
      auto const first = line.find_first_not_of(" \t");
      lines += first != std::string::npos && line.compare(first, 2, "//") != 0 ? 1 : 0;
    }
  };
  for (std::string const& header : headers) {
    std::filesystem::path const path = std::filesystem::path(PALPATE_HEADERS) / header;
    if (std::filesystem::is_directory(path))
      for (auto const& file : std::filesystem::directory_iterator(path)) add(file.path());
    else
      add(path);
  }
  return lines;
}

TetrahedralMesh<double> filled(Problem const& problem, double edge) { return fill(problem.skin, {.edge = edge}).mesh; }

struct CarriedSkin::Surface : EmbeddedSurface<double> {
  using EmbeddedSurface<double>::EmbeddedSurface;
};
CarriedSkin::CarriedSkin(Problem const& problem, TetrahedralMesh<double> const& mesh) : surface_(std::make_unique<Surface>(problem.skin, mesh)) {}
CarriedSkin::~CarriedSkin() = default;
Matrix3X<double> CarriedSkin::at(Matrix3X<double> const& positions) {
  surface_->update(positions);
  return surface_->points();
}

Distance distance(Problem const& problem, Row const& row, Row const& reference) {
  Matrix3X<double> const off = row.skin.points - reference.skin.points;
  return {off.norm() / (reference.skin.points - problem.skin.points).norm(), off.colwise().norm().maxCoeff()};
}

}  // namespace models
