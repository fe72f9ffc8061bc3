// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/vtk/detail/text_scanner.hpp>

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate::detail {

/// The vertices and faces of a Wavefront OBJ file, in the order of the file; texture and normal indices are skipped.
/// VTK's own reader makes a point of every vertex/texture/normal triple, which tears the surface apart at each face,
/// and passes over a line that is cut short. Here every vertex stays one point and such a line is an error.
inline vtkSmartPointer<vtkPolyData> scan_obj(std::string_view text, std::string const& name) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> faces;
  vtkIdType largest = -1;
  long long line_of_largest = 0, line_number = 0;
  std::vector<vtkIdType> corners;

  auto const fail = [&](long long line, auto const&... parts) {
    throw FileError(message(name, ", line ", line, ": ", parts...));
  };
  while (!text.empty()) {
    std::string_view line = take_line(text);
    ++line_number;
    std::string joined;
    while (line.ends_with('\\') && !text.empty()) {   // the statement goes on in the next line
      std::string longer(line.substr(0, line.size() - 1));
      longer.append(" ").append(take_line(text));
      joined = std::move(longer);
      line = joined;
      ++line_number;
    }
    std::string_view const keyword = take_word(line);
    if (keyword == "v") {
      double x[3];
      for (double& coordinate : x) {
        std::string_view const word = take_word(line);
        if (word.empty()) fail(line_number, "a vertex has fewer than three coordinates; was the file cut short?");
        auto const number = to_number<double>(word);
        if (!number) fail(line_number, "\"", word, "\" is not a coordinate");
        coordinate = *number;
      }
      points->InsertNextPoint(x);
    } else if (keyword == "f") {
      corners.clear();
      for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
        if (word.starts_with('#')) break;
        auto const index = to_number<long long>(word.substr(0, word.find('/')));
        if (!index || *index == 0) fail(line_number, "\"", word, "\" is not a corner of a face");
        vtkIdType const point = *index > 0 ? *index - 1 : points->GetNumberOfPoints() + *index;
        if (point < 0) fail(line_number, "a face refers to vertex ", *index, " of ", points->GetNumberOfPoints());
        if (point > largest) {
          largest = point;
          line_of_largest = line_number;
        }
        corners.push_back(point);
      }
      if (corners.size() < 3) fail(line_number, "a face has ", corners.size(), " corners; was the file cut short?");
      faces->InsertNextCell(static_cast<vtkIdType>(corners.size()), corners.data());
    }
  }
  if (largest >= points->GetNumberOfPoints())
    fail(line_of_largest, "a face refers to vertex ", largest + 1, ", the file has ", points->GetNumberOfPoints(),
         "; was it cut short?");
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  surface->SetPoints(points);
  surface->SetPolys(faces);
  return surface;
}

}  // namespace palpate::detail
