// SPDX-License-Identifier: MIT
#include "outputs.hpp"

#include "../solid_picture.hpp"

#include <palpate/vtk/picture.hpp>

#include <cstdio>
#include <utility>

namespace retraction {

using namespace palpate;

Outputs::Outputs(Options const& options, Organ const& organ) : options_(options), skin_(organ.skin, organ.solid) {
  if (options_.pictures && !display_.ready()) {
    std::fprintf(stderr, "retraction: no pictures: %s\n", display_.problem().c_str());
    options_.pictures = false;
  }
}

void Outputs::draw(std::string const& name, Body const& body, Tools const& tools) {
  if (!options_.pictures) return;
  skin_.follow(body);
  auto const is_wound = [&](int t) { return body.tissue().is_wound(t); };
  auto const picture = drawing::solid_picture(skin_.mesh(), {drawing::border_part(body.positions(), body.triangles(), is_wound, true), skin_.skirt(body)});
  std::vector<PicturePart> hooks;
  for (auto const* rods : {&tools.left, &tools.right}) {
    PicturePart hook{.mesh = rods->shape().picture};
    hook.mesh.points = (rods->pose().orientation.toRotationMatrix() * hook.mesh.points).colwise() + rods->pose().position;
    hooks.push_back(std::move(hook));
  }
  PictureTool const blade{.tip = tools.tip, .axis = Vector(0.15, 0.3, 1), .edge = Vector::UnitX(), .length = 0.11};
  Plan const plan;
  PictureStyle style;
  style.tissue = {0.60, 0.24, 0.19}, style.interior = {0.80, 0.20, 0.17}, style.wound_depth = 0;   // flesh
  Camera const camera = looking_at(Vector(plan.x, plan.y, 0.022), 0.056, Vector(0.25, -1.0, 1.7), Vector::UnitZ());
  write_picture(options_.out / (name + ".png"), picture, camera, blade, style, hooks);
  wrote(name + ".png");
}

void Outputs::add_frame(double time, Body const& body) {
  if (!series_) series_ = std::make_unique<SeriesWriter>(options_.out / "retraction.pvd"), wrote("retraction.pvd");
  auto const now = body.solid(), before = body.rest_solid();
  series_->add(time, now, Matrix3X<double>(now.points - before.points), solid_fields(body.tissue(), now.points));
}

std::string Outputs::written() const {
  std::string names;
  for (std::string const& name : written_) names += (names.empty() ? "" : ", ") + name;
  return names;
}

}  // namespace retraction
