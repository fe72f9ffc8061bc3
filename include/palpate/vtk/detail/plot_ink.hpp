// SPDX-License-Identifier: MIT
#pragma once

#include <vtkBrush.h>
#include <vtkContext2D.h>
#include <vtkContextItem.h>
#include <vtkObjectFactory.h>
#include <vtkPen.h>
#include <vtkTextProperty.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace palpate::detail {

/// What VTK's charts can not draw: powers of ten with their exponents raised, and arrow heads on lines. In pixels from the lower left corner.
class PlotInk : public vtkContextItem {
 public:
  vtkTypeMacro(PlotInk, vtkContextItem);
  static PlotInk* New() { VTK_STANDARD_NEW_BODY(PlotInk); }

  struct Power {
    float x, y;   ///< where the label is centred, or ends when it stands to the left of an axis
    int exponent;
    bool ends;
  };
  struct Arrow {
    std::array<float, 2> middle, way;   ///< way of length 1
    std::array<unsigned char, 3> colour;
  };
  int text_size = 14;
  std::vector<Power> powers{};
  std::vector<Arrow> arrows{};

  bool Paint(vtkContext2D* painter) override {
    auto const size = static_cast<float>(text_size);
    for (Power const& power : powers) {
      std::string const ten = power.exponent == 0 ? "1" : "10", raised = power.exponent == 0 ? "" : exponent_text(power.exponent);
      float const wide = width(painter, ten, text_size), small = raised.empty() ? 0.0F : width(painter, raised, text_size * 7 / 10);
      float const left = power.ends ? power.x - wide - small : power.x - (wide + small) / 2;
      write(painter, ten, left, power.y, text_size);
      if (!raised.empty()) write(painter, raised, left + wide, power.y + 0.4F * size, text_size * 7 / 10);
    }
    for (Arrow const& arrow : arrows) {
      auto const [x, y] = arrow.middle;
      float const along = 0.5F * size, aside = 0.3F * size;
      painter->GetPen()->SetColor(arrow.colour[0], arrow.colour[1], arrow.colour[2], 255);
      painter->GetPen()->SetLineType(vtkPen::SOLID_LINE);
      painter->GetBrush()->SetColor(arrow.colour[0], arrow.colour[1], arrow.colour[2], 255);
      std::array<float, 6> corners{x + along * arrow.way[0], y + along * arrow.way[1],
                                   x - along * arrow.way[0] - aside * arrow.way[1], y - along * arrow.way[1] + aside * arrow.way[0],
                                   x - along * arrow.way[0] + aside * arrow.way[1], y - along * arrow.way[1] - aside * arrow.way[0]};
      painter->DrawPolygon(corners.data(), 3);
    }
    return true;
  }

 protected:
  PlotInk() = default;

 private:
  static std::string exponent_text(int exponent) { return (exponent < 0 ? "\xE2\x88\x92" : "") + std::to_string(std::abs(exponent)); }   // a minus sign

  static void letters(vtkContext2D* painter, int points) {
    painter->GetTextProp()->SetFontSize(points);
    painter->GetTextProp()->SetColor(0.0, 0.0, 0.0);
    painter->GetTextProp()->SetOpacity(1.0);
    painter->GetTextProp()->SetOrientation(0.0);
    painter->GetTextProp()->SetJustificationToLeft();
    painter->GetTextProp()->SetVerticalJustificationToBottom();
  }
  static float width(vtkContext2D* painter, std::string const& text, int points) {
    letters(painter, points);
    std::array<float, 4> box{};
    painter->ComputeStringBounds(text.c_str(), box.data());
    return box[2] + 1.0F;
  }
  static void write(vtkContext2D* painter, std::string const& text, float x, float y, int points) {
    letters(painter, points);
    float const space = width(painter, ' ' + text, points) - width(painter, text, points);
    painter->DrawString(std::round(x - space), std::round(y), (' ' + text + ' ').c_str());   // without spaces a stroke at an edge shows at the other edge too
  }
};

}  // namespace palpate::detail
