// SPDX-License-Identifier: MIT
#include "panel.hpp"

#include "scene.hpp"

#include <vtkBrush.h>
#include <vtkContext2D.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPen.h>
#include <vtkTextProperty.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

namespace viewer {

vtkStandardNewMacro(Panel)
vtkStandardNewMacro(Cards)

namespace {

struct Ink {
  unsigned char red, green, blue, alpha = 255;
};
constexpr Ink paper{255, 255, 255}, dark{35, 42, 50}, grey{105, 115, 125}, faint{226, 230, 233}, button_ink{238, 242, 245};
constexpr Ink no_contact{120, 132, 142}, indenting{0, 114, 178}, moving{178, 34, 34}, good{0, 158, 115}, warning{213, 94, 0}, recording{204, 30, 40};

Ink ink_of(Colour const& colour) {
  auto const byte = [](double share) { return static_cast<unsigned char>(std::lround(255.0 * share)); };
  return {byte(colour[0]), byte(colour[1]), byte(colour[2])};
}

void fill(vtkContext2D* painter, Ink const& ink) {
  painter->GetPen()->SetLineType(vtkPen::NO_PEN);
  painter->GetBrush()->SetColor(ink.red, ink.green, ink.blue, ink.alpha);
}

/// A box with round corners.
void paint_box(vtkContext2D* painter, Box const& box, double radius, Ink const& ink) {
  fill(painter, ink);
  std::vector<float> outline;
  constexpr int steps = 6;
  for (int corner = 0; corner < 4; ++corner)
    for (int k = 0; k <= steps; ++k) {
      double const turn = std::numbers::pi / 2 * (corner + static_cast<double>(k) / steps);
      double const x = corner == 0 || corner == 3 ? box.right() - radius : box.x + radius, y = corner < 2 ? box.top() - radius : box.y + radius;
      outline.push_back(static_cast<float>(x + radius * std::cos(turn)));
      outline.push_back(static_cast<float>(y + radius * std::sin(turn)));
    }
  painter->DrawPolygon(outline.data(), static_cast<int>(outline.size() / 2));
}

void write(vtkContext2D* painter, double x, double y, std::string const& text, int size, Ink const& ink, bool bold = false,
           int side = VTK_TEXT_LEFT) {
  vtkNew<vtkTextProperty> look;
  look->SetFontFamilyToArial();
  look->SetFontSize(size);
  look->SetBold(bold);
  look->SetColor(ink.red / 255.0, ink.green / 255.0, ink.blue / 255.0);
  look->SetJustification(side);
  look->SetVerticalJustificationToCentered();
  painter->ApplyTextProp(look);
  painter->DrawString(static_cast<float>(std::round(x)), static_cast<float>(std::round(y)), text);
}

template <class... Numbers>
std::string format(char const* pattern, Numbers... numbers) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, numbers...);
  return text;
}

std::string pictures_of(PictureClock const& pictures) {
  std::string const rate = pictures.rate() > 0.0 ? format("%.0f a second", pictures.rate()) : std::string();
  std::string const look = pictures.is_plain() ? "plain (no GPU)" : "edges smoothed";
  return rate.empty() ? look : rate + ", " + look;
}

std::string hook_of(HookMoment const& hook) {
  if (hook.is_parked()) return "away  (2 puts it in)";
  if (hook.tick.phase == palpate::CuttingPhase::no_contact) return "in the air";
  return format("%.2f N, %s", hook.tick.force.norm(), hook.is_hooked ? "hooked in" : "presses");
}

struct Phase {
  char const* word;
  Ink ink;
};
Phase phase_of(palpate::CuttingPhase phase) {
  if (phase == palpate::CuttingPhase::indenting) return {"pressing", indenting};
  if (phase == palpate::CuttingPhase::moving) return {"cutting", moving};
  return {"no contact", no_contact};
}

}  // namespace

bool Panel::Paint(vtkContext2D* painter) {
  Box const& panel = layout_.panel;
  paint_box(painter, panel, 0.1, paper);
  fill(painter, faint);
  painter->DrawRect(static_cast<float>(panel.x), 0.0f, 1.0f, static_cast<float>(panel.height));
  paint_state(painter);
  paint_buttons(painter);
  return true;
}

bool Cards::Paint(vtkContext2D* painter) {
  paint_legend(painter);
  if (helps_) paint_help(painter);
  return true;
}

void Panel::paint_state(vtkContext2D* painter) const {
  Moment const& now = live_.now;
  Phase const phase = phase_of(now.tick.phase);
  Box const& title = layout_.title;
  paint_box(painter, {title.x, title.y + 12.0, 124.0, 28.0}, 14.0, phase.ink);
  write(painter, title.x + 62.0, title.y + 26.0, phase.word, 15, paper, true, VTK_TEXT_CENTERED);
  write(painter, title.right() - 4.0, title.y + 26.0, format("%.2f N", now.tick.force.norm()), 26, dark, true, VTK_TEXT_RIGHT);

  struct Row {
    char const* name;
    std::string value;
    Ink ink = dark;
  };
  double const taken = 1000.0 * now.energy;   // mJ
  bool const passive = taken > -0.005;
  Row const rows[row_count] = {
      {"depth", format("%.1f mm  (press to %.0f mm)", 1000.0 * now.tick.depth, 1000.0 * press_depth_)},
      {"hook", hook_of(live_.hook)},
      {"energy", format("%.2f mJ", std::abs(taken) < 0.005 ? 0.0 : taken)},
      {"passivity", passive ? "passive" : "gave more than it took", passive ? good : warning},
      {"servo", (realtime_ ? format("%.0f Hz, ", live_.servo.rate) : "") + format("p99 %.0f µs of 1000 µs%s", 1e6 * live_.servo.p99, realtime_ ? "" : ", lock-step")},
      {"pictures", pictures_of(pictures_)},
      {"tissue", to_string(live_.setup.tissue)},
      {"integrator", to_string(live_.setup.integrator)},
      {"coupling", to_string(live_.setup.coupling)},
      {"cutter", to_string(live_.setup.blade)},
      {"just now", live_.note, grey},
  };
  double y = layout_.rows.top() - layout_.row_height / 2;
  for (Row const& row : rows) {
    write(painter, layout_.rows.x, y, row.name, 14, grey);
    std::string value = row.value;
    if (value.size() > 40) value = "..." + value.substr(value.size() - 37);   // the end of a long path tells more
    write(painter, layout_.rows.x + 92.0, y, value, 14, row.ink);
    y -= layout_.row_height;
  }
}

void Panel::paint_buttons(vtkContext2D* painter) const {
  for (std::size_t k = 0; k < layout_.buttons.size(); ++k) {
    Box const& box = layout_.buttons[k];
    Button const button = all_buttons[k];
    bool const records = button == Button::record && live_.doing == Doing::recording;
    bool const replays = button == Button::replay && live_.doing == Doing::replaying;
    bool const possible = button == Button::record || (button == Button::replay ? live_.can_replay : !live_.is_uncut);
    paint_box(painter, box, 8.0, records ? recording : replays ? indenting : button_ink);
    Ink const ink = records || replays ? paper : possible ? dark : Ink{170, 178, 185};
    double const x = box.x + 17.0, y = box.y + box.height / 2;
    fill(painter, records || replays ? paper : button == Button::record ? recording : ink);
    auto const f = [](double value) { return static_cast<float>(value); };
    if (records || replays) {
      painter->DrawRect(f(x - 5), f(y - 5), 10.0f, 10.0f);
    } else if (button == Button::record) {
      painter->DrawEllipse(f(x), f(y), 6.0f, 6.0f);
    } else if (button == Button::replay) {
      float corners[] = {f(x - 4), f(y - 6), f(x - 4), f(y + 6), f(x + 6), f(y)};
      painter->DrawPolygon(corners, 3);
    } else {   // back, once or all the way
      float corners[] = {f(x - 5), f(y), f(x + 4), f(y + 5), f(x + 4), f(y - 5)};
      painter->DrawPolygon(corners, 3);
      if (button == Button::undo_all) painter->DrawRect(f(x - 7), f(y - 5), 2.0f, 10.0f);
    }
    char const* const word = button == Button::record ? "Record" : button == Button::replay ? "Replay" : button == Button::undo ? "Undo" : "Reset";
    write(painter, box.x + 29.0, y, records || replays ? format("%.1f s", live_.doing_seconds) : std::string(word), 14, ink);
  }
}

void Cards::paint_legend(vtkContext2D* painter) const {
  Box const& scene = layout_.scene;
  struct Entry {
    char const* word;
    Ink ink;
    double width;
  };
  std::string const arrow = format("force, %.0f mm for 1 N", 1000.0 * arrow_per_newton);
  std::vector<Entry> entries{{"tip of the tool", ink_of(colours::tip), 118.0},
                             {"proxy on the surface", ink_of(colours::proxy), 158.0},
                             {arrow.c_str(), ink_of(colours::force), 160.0}};
  if (has_hook_) entries.push_back({"on the hook", ink_of(colours::hook_force), 96.0});
  Box const card{14.0, scene.top() - 44.0, has_hook_ ? 568.0 : 456.0, 30.0};
  paint_box(painter, card, 8.0, {255, 255, 255, 190});
  double x = card.x + 16.0;
  for (Entry const& entry : entries) {
    fill(painter, entry.ink);
    painter->DrawEllipse(static_cast<float>(x), static_cast<float>(card.y + 15.0), 6.0f, 6.0f);
    write(painter, x + 12.0, card.y + 15.0, entry.word, 13, dark);
    x += entry.width + 4.0;
  }
}

void Cards::paint_help(vtkContext2D* painter) const {
  struct Line {
    char const *key, *what;
  };
  constexpr Line lines[] = {{"mouse", "moves the tool"},     {"left button", "presses, drag to cut"}, {"wheel", "deeper, nearer"},
                            {"right button", "turns the view"}, {"+  -", "nearer, farther"},
                            {"2", "a hook: in here, away"},  {"arrows", "draw the hook aside"},
                            {"t  i", "tissue, integrator"},  {"c  k", "coupling, cutter"},        {"r  p", "record, replay"},
                            {"u  space", "undo, reset"},       {"h  q", "this help, quit"}};
  Box const& card = layout_.help;
  paint_box(painter, card, 10.0, {255, 255, 255, 205});
  double y = card.top() - 19.0;
  for (Line const& line : lines) {
    write(painter, card.x + 16.0, y, line.key, 13, dark, true);
    write(painter, card.x + 116.0, y, line.what, 13, dark);
    y -= 21.0;
  }
}

}  // namespace viewer
