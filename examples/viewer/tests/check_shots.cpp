// SPDX-License-Identifier: MIT
// Looks at the viewer's pictures and compares them with what the simulator says in report.txt. Where a point of the world is in a picture is worked
// out here, from the camera alone, by a pinhole projection.
//   check_shots FOLDER           the pictures of stroke.script
//   check_shots FOLDER NAME...   these
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Point = std::array<double, 3>;
using Pixel = std::array<double, 2>;
using Values = std::map<std::string, std::vector<double>>;

struct Shot {
  std::string name, phase, note;
  Values values;

  double one(char const* key) const { return values.at(key).at(0); }
  Point point(char const* key) const { return {values.at(key).at(0), values.at(key).at(1), values.at(key).at(2)}; }
};

Point minus(Point const& a, Point const& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(Point const& a, Point const& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point cross(Point const& a, Point const& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
Point scaled(Point const& a, double s) { return {s * a[0], s * a[1], s * a[2]}; }
double length(Point const& a) { return std::sqrt(dot(a, a)); }

Pixel projected(Shot const& shot, Point const& p) {
  Point const eye = shot.point("camera"), to = minus(shot.point("target"), eye), ahead = scaled(to, 1.0 / length(to));
  Point const side = cross(ahead, shot.point("up")), right = scaled(side, 1.0 / length(side)), above = cross(right, ahead);
  auto const& scene = shot.values.at("scene");   // x, y, width, height
  double const angle = shot.one("view_angle") * 3.14159265358979323846 / 180.0;   // of the height
  double const focal = scene[3] / 2.0 / std::tan(angle / 2.0);   // pixels
  Point const d = minus(p, eye);
  double const depth = dot(d, ahead);
  return {scene[0] + scene[2] / 2.0 + focal * dot(d, right) / depth, scene[1] + scene[3] / 2.0 + focal * dot(d, above) / depth};
}

class Picture {
 public:
  explicit Picture(std::string const& file) {
    reader_->SetFileName(file.c_str());
    is_good_ = reader_->CanReadFile(file.c_str()) != 0;
    if (is_good_) reader_->Update();
  }
  bool is_good() const { return is_good_; }

  template <class Is>
  bool is(Is const& colour, double x, double y) {
    vtkImageData* const image = reader_->GetOutput();
    int const i = static_cast<int>(x), j = static_cast<int>(y);
    if (i < 0 || j < 0 || i >= image->GetDimensions()[0] || j >= image->GetDimensions()[1]) return false;
    auto const* const p = static_cast<unsigned char const*>(image->GetScalarPointer(i, j, 0));
    return colour(p[0], p[1], p[2]);
  }
  template <class Is>
  int count(Is const& colour, double x, double y, double width, double height) {
    int found = 0;
    for (double j = y; j < y + height; ++j)
      for (double i = x; i < x + width; ++i) found += is(colour, i, j);
    return found;
  }

 private:
  vtkNew<vtkPNGReader> reader_;
  bool is_good_ = false;
};

bool is_tip(int r, int g, int b) { return b > 95 && r < 0.35 * b && g > 0.4 * b && g < 0.85 * b; }
bool is_proxy(int r, int g, int b) { return r > 130 && g > 0.8 * r && b < 0.5 * r; }
bool is_arrow(int r, int g, int b) { return g > 85 && r < 0.35 * g && b > 0.5 * g && b < 0.92 * g; }
bool is_hook_arrow(int r, int g, int b) { return b > 120 && g > 0.70 * b && g < 0.88 * b && r > 0.25 * b && r < 0.50 * b; }
bool is_energy(int r, int g, int b) { return r > 170 && g > 0.35 * r && g < 0.75 * r && b < 0.5 * r; }
bool is_wound(int r, int g, int b) { return r > 25 && r > 4 * std::max(g, b); }   // a purer red than the tissue's

constexpr double legend_height = 50.0;   // at the top of the scene: it shows the colours too

class Check {
 public:
  Check(Shot const& shot, Picture& picture) : shot_(shot), picture_(picture) {}

  bool tip() {
    Pixel const at = projected(shot_, shot_.point("tip"));
    int const found = picture_.count(is_tip, at[0] - 7, at[1] - 7, 14, 14);
    return say(found >= 25, "tip at %.0f %.0f, %d pixels of its colour", at[0], at[1], found);
  }
  bool proxy() {
    Pixel const at = projected(shot_, shot_.point("proxy"));
    int const found = picture_.count(is_proxy, at[0] - 5, at[1] - 5, 10, 10);
    bool const touches = shot_.one("touches") > 0.0;
    return say(touches ? found >= 12 : found == 0, "proxy %s, %d pixels of its colour", touches ? "touches" : "does not touch", found);
  }
  bool arrow() { return arrow("arrow", is_arrow, 0, shot_.point("force"), shot_.point("proxy")); }
  /// In the tissue or not, and the arrow of the force on it. The rim of the tip's ball has its colour, too: a few pixels.
  bool hook(bool is_in) {
    bool const good = arrow("arrow of the hook", is_hook_arrow, 20, shot_.point("hook_force"), shot_.point("hook"));
    double const force = length(shot_.point("hook_force")), hooked = shot_.one("hooked");
    return good & say(is_in ? hooked == 1.0 && force > 0.1 : hooked == 0.0 && force == 0.0, "hooked %.0f, with %.2f N", hooked, force);
  }
  int wound_pixels() { return picture_.count(is_wound, 0, 0, scene(2), scene(3) - legend_height); }
  /// The hook was drawn 9 mm nearer since, beside a wound: it is lower in the picture, the tissue draws it back, and the wound is wider.
  bool drawn_since(Shot const& before, int wound_before) {
    Point const way = minus(shot_.point("hook"), before.point("hook")), more = minus(shot_.point("hook_force"), before.point("hook_force"));
    Pixel const a = projected(before, before.point("hook")), b = projected(shot_, shot_.point("hook"));
    bool good = say(std::abs(length(way) - 0.009) < 0.0003, "drawn %.2f mm", 1000.0 * length(way));
    good &= say(a[1] - b[1] > 10.0 && std::abs(b[0] - a[0]) < 0.3 * (a[1] - b[1]), "%.0f pixels to the right, %.0f down", b[0] - a[0], a[1] - b[1]);
    good &= say(dot(more, way) < -0.2 * length(way), "it is drawn back with %.2f N more", -dot(more, way) / length(way));
    int const now = wound_pixels();
    return good & say(now > 1.3 * wound_before, "a wound of %d pixels, before it was drawn %d", now, wound_before);
  }
  bool wound(bool is_there) {
    int const found = wound_pixels();
    return say(is_there ? found > 700 : found < 20, "%d pixels of a wound", found);
  }
  /// Reads the curve's end off the picture.
  bool chart(char const* which, bool (*colour)(int, int, int)) {
    auto const& c = shot_.values.at(which);   // time, value, pixels of (now − 1 s, 0) and (now, 1)
    double const per_second = c[4] - c[2], per_unit = c[5] - c[3], x = c[4] + per_second * (c[0] - shot_.one("time"));
    double top = -1.0, low = -1.0;
    for (double y = c[3] - 60.0; y < scene(3); ++y)
      if (std::abs(y - c[3] - c[1] * per_unit) < 130.0 && picture_.is(colour, x - 2.0, y)) {
        if (low < 0.0) low = y;
        top = y;
      }
    double const read = ((top + low + 1.0) / 2.0 - c[3]) / per_unit;
    return say(low >= 0.0 && std::abs(read - c[1]) <= 3.5 / per_unit, "%s ends at %.3f, and in the picture at %.3f", which, c[1], read);
  }
  bool force_is_in_the_chart() {
    double const force = length(shot_.point("force")), value = shot_.values.at("force_chart").at(1);
    return say(std::abs(force - value) <= 0.02 + 0.1 * force, "the hand feels %.3f N, the chart ends at %.3f N", force, value);
  }
  bool says(bool good, char const* what) { return say(good, "%s: phase %s, note \"%s\"", what, shot_.phase.c_str(), shot_.note.c_str()); }

 private:
  bool arrow(char const* what, bool (*colour)(int, int, int), int strays, Point const& force, Point const& from) {
    Point const way = scaled(force, shot_.one("arrow_per_newton"));
    if (length(force) < 0.03) {
      int const found = picture_.count(colour, 0, 0, scene(2), scene(3) - legend_height);
      return say(length(force) > 0.0 || found <= strays, "no %s, %d pixels of its colour", what, found);
    }
    Pixel const a = projected(shot_, from), b = projected(shot_, {from[0] + way[0], from[1] + way[1], from[2] + way[2]});
    double const wanted = std::hypot(b[0] - a[0], b[1] - a[1]);
    double seen = 0.0;
    for (double s = 0.0; s < 2.0 * wanted; s += 0.5) {
      double const x = a[0] + s / wanted * (b[0] - a[0]), y = a[1] + s / wanted * (b[1] - a[1]);
      if (y < scene(3) - legend_height && picture_.is(colour, x, y)) seen = s;
    }
    return say(std::abs(seen - wanted) <= 3.0 + 0.05 * wanted, "%s of %.0f pixels for %.2f N, which makes %.0f", what, seen, length(force), wanted);
  }
  double scene(std::size_t k) const { return shot_.values.at("scene").at(k); }

  template <class... Parts>
  bool say(bool good, char const* pattern, Parts... parts) {
    std::printf("%s%s: ", good ? "" : "FAILED: ", shot_.name.c_str());
    std::printf(pattern, parts...);
    std::printf("\n");
    return good;
  }

  Shot const& shot_;
  Picture& picture_;
};

std::vector<Shot> read_report(std::string const& file) {
  std::ifstream text(file);
  std::vector<Shot> shots;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    std::string const rest = line.size() > key.size() ? line.substr(key.size() + 1) : std::string();
    if (key == "shot") shots.push_back({.name = rest, .phase = {}, .note = {}, .values = {}});
    if (shots.empty()) continue;
    if (key == "phase") shots.back().phase = rest;
    if (key == "note") shots.back().note = rest;
    if (key == "shot" || key == "phase" || key == "note") continue;
    for (double value; words >> value;) shots.back().values[key].push_back(value);
  }
  return shots;
}

/// What has to be in each picture.
struct Expected {
  char const *name, *phase;
  bool has_wound;
  char const* note = "";   // a part of it
  bool of_stroke = true;   // one of stroke.script's
  bool hook_is_in = false;
};
constexpr Expected all_expected[] = {{"hovering", "no contact", false},        {"pressing", "indenting", false}, {"punctured", "moving", false},
                                     {"cutting", "moving", true},              {"cut", "no contact", true, "recorded"},
                                     {"replayed", "no contact", true, "same bytes"}, {"undone", "no contact", false, "took back"},
                                     {"tight", "indenting", false},            {"proxy", "indenting", false, "proxy"},
                                     {"firm", "indenting", false, "", false},
                                     {"solid", "indenting", false, "", false}, {"solid_cut", "no contact", true, "cut: ", false},
                                     {"solid_undone", "no contact", false, "took back", false},
                                     {"unhooked", "no contact", true, "", false},
                                     {"hooked", "no contact", true, "", false, true},
                                     {"drawn", "no contact", true, "", false, true},
                                     {"cutting_on", "moving", true, "", false, true},
                                     {"lifted", "no contact", true, "hook lifted away", false}};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  std::string const folder = argv[1];
  auto const is_asked_for = [&](Expected const& shot) {
    return argc == 2 ? shot.of_stroke : std::find(argv + 2, argv + argc, std::string(shot.name)) != argv + argc;
  };
  auto const shots = read_report(folder + "/report.txt");
  bool good = true;
  Shot const* before_drawn = nullptr;
  int wound_before = 0;
  for (Expected const& expected : all_expected) {
    if (!is_asked_for(expected)) continue;
    auto const shot = std::find_if(shots.begin(), shots.end(), [&](Shot const& s) { return s.name == expected.name; });
    Picture picture(folder + "/" + expected.name + ".png");
    if (shot == shots.end() || !picture.is_good()) {
      std::printf("FAILED: there is no report or no picture of %s\n", expected.name);
      good = false;
      continue;
    }
    Check check(*shot, picture);
    good &= check.says(shot->phase == expected.phase && shot->note.find(expected.note) != std::string::npos, "state");
    good &= check.tip();
    good &= check.proxy();
    good &= check.arrow();
    good &= check.hook(expected.hook_is_in);
    if (std::string(expected.name) == "hooked") before_drawn = &*shot, wound_before = check.wound_pixels();
    if (std::string(expected.name) == "drawn" && before_drawn != nullptr) good &= check.drawn_since(*before_drawn, wound_before);
    if (shot->name != "punctured") good &= check.wound(expected.has_wound);   // a puncture is too small to be counted
    good &= check.force_is_in_the_chart();
    good &= check.chart("force_chart", is_arrow);
    good &= check.chart("energy_chart", is_energy);
  }
  return good ? 0 : 1;
}
