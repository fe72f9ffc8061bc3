// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/vtk/detail/check_files.hpp>

#include <vtkCellType.h>
#include <vtkCharArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetReader.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::detail {

/// Throws `FileError` where VTK's reader of legacy files would read or write beyond its lists: numbers that can not be, a list of cells (before version 5) that
/// is not as long as it announces, corners that are no vertices, more or fewer types than cells, polyhedra. "POLYGONS cells size" is followed by `size` integers,
/// each cell its number of corners and the corners. A keyword is found as VTK finds it, by the begin of a word in either case, and must stand there once.
class LegacyCheck {
 public:
  /// `bytes` and `name` must outlive the object.
  LegacyCheck(std::string_view bytes, std::string const& name) : bytes_(bytes), name_(name) {}

  /// The file without the data of fields, points and cells. `surface`: POLYDATA is as good as an UNSTRUCTURED_GRID.
  std::string operator()(bool surface) {
    rest_ = bytes_;
    constexpr std::string_view title = "# vtk DataFile Version ";
    if (!rest_.starts_with(title)) fail("a VTK file begins with \"", title, "\"");
    rest_.remove_prefix(title.size());
    std::string_view const version = take_word(rest_);
    auto const point = std::min(version.find('.'), version.size());
    auto const major = to_number<int>(version.substr(0, point));
    if (!major || *major < 1 || *major > 5 || !to_number<unsigned>(version.substr(std::min(point + 1, version.size()))))
      fail("\"", legible(version), "\" is not a known version of VTK files");
    take_line(rest_);
    take_line(rest_);   // a title
    std::string const mode = next_word();
    text_ = mode == "ascii";
    if (!text_ && mode != "binary") fail("\"", legible(mode), "\" stands where ASCII or BINARY should; the file was cut short or is damaged");
    std::string const dataset = next_word();
    std::string_view const kind = take_word(rest_);
    bool const grid = lower_case(std::string(kind)) == "unstructured_grid";
    if (dataset != "dataset" || !(grid || (surface && lower_case(std::string(kind)) == "polydata")))
      fail("there is no ", surface ? "surface" : "unstructured grid", " in this file, it holds \"", legible(kind), "\"; ",
           surface ? "POLYDATA and UNSTRUCTURED_GRID are" : "UNSTRUCTURED_GRID is", " read");
    std::string result(bytes_.substr(0, bytes_.size() - rest_.size()));
    lower_ = lower_case(std::string(rest_));
    std::vector<std::string_view> const lists = grid ? std::vector<std::string_view>{"CELLS", "CELL_TYPES"}
                                                     : std::vector<std::string_view>{"VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS"};
    std::size_t begin = find("points"), end = lower_.size();
    for (std::string_view const list : lists) begin = std::min(begin, find(lower_case(std::string(list))));
    begin = std::min(begin, end);
    for (char const* const data : {"point_data", "cell_data"}) end = std::min(end, find(data, begin));
    rest_ = rest_.substr(begin, end - begin);
    lower_ = lower_.substr(begin, end - begin);
    if (find("field") != std::string::npos) fail("FIELD stands after the first list; move it up, or save the file again");

    bool const lists_of_corners = *major < 5;   // later: offsets, which VTK checks
    auto const points = counts("POINTS", 1);
    vertices_ = points ? points->number : 0;
    if (points && text_) check_coordinates(points->rest);
    if (!grid) {
      for (std::string_view const list : lists)
        if (auto const found = counts(list, 2); found && lists_of_corners) check(list, *found);
    } else {
      auto const cells = counts("CELLS", 2), types = counts("CELL_TYPES", 1);
      if (!cells || !types) fail("POINTS, CELLS and CELL_TYPES make a grid, and ", cells ? "CELL_TYPES" : "CELLS", " is missing; the file was cut short or is damaged");
      long long const number = lists_of_corners ? cells->number : std::max(cells->number - 1, 0LL);   // of offsets there is one more
      if (number != types->number)
        fail(number, " cells and ", types->number, " types of cells are announced; the file is damaged");
      if (lists_of_corners) check("CELLS", *cells);
      check_types(*types);
    }
    return result.append("\n").append(rest_);
  }

 private:
  struct Counts {
    long long number, size;
    std::string_view rest;   // what follows them
  };

  [[noreturn]] void fail(auto const&... parts) const { throw FileError(message(name_, ": ", parts...)); }

  std::string next_word() { return lower_case(std::string(take_word(rest_))); }

  /// Where `word` begins in what follows the header; in a text only where VTK may begin to read one, after a blank or a number.
  std::size_t find(std::string_view word, std::size_t from = 0) const {
    auto const begins = [&](std::size_t at) {
      auto const before = at > 0 ? lower_.find_last_not_of("0123456789.e+-", at - 1) : std::string::npos;
      return before == std::string::npos || std::string_view(" \t\r\n\v\f").find(lower_[before]) != std::string_view::npos;
    };
    auto at = lower_.find(word, from);
    while (text_ && at != std::string::npos && !begins(at)) at = lower_.find(word, at + 1);
    return at;
  }

  /// The one or two numbers that follow a keyword; nothing if there is no such word.
  std::optional<Counts> counts(std::string_view keyword, int wanted) const {
    std::string const word = lower_case(std::string(keyword));
    auto const at = find(word);
    if (at == std::string::npos) return std::nullopt;
    Counts found{0, 0, rest_.substr(at)};
    std::string_view const whole = take_word(found.rest);
    if (whole.size() != word.size()) fail("\"", legible(whole), "\" stands where ", keyword, " should; the file is damaged");
    if (find(word, at + 1) != std::string::npos) fail(keyword, " stands there more than once; the file is damaged, or has field data with that word, which has to go");
    auto const most = static_cast<long long>(bytes_.size());   // a number of elements takes at least as many bytes
    for (int i = 0; i < wanted; ++i) {
      std::string_view const number = take_word(found.rest);
      auto const value = to_number<long long>(number);
      if (!value || *value < 0 || *value > most) fail(keyword, " announces \"", legible(number), "\", which does not fit; the file was cut short or is damaged");
      (i == 0 ? found.number : found.size) = *value;
    }
    if (!text_) take_line(found.rest);
    return found;
  }

  /// "nan" and "inf", where VTK says that sizes do not match.
  void check_coordinates(std::string_view rest) const {
    take_word(rest);   // their type
    for (long long i = 0; i < 3 * vertices_; ++i) {
      std::string_view const word = take_word(rest);
      if (auto const value = to_number<double>(word); value && !std::isfinite(*value))
        fail("the ", std::string(1, "xyz"[i % 3]), " coordinate of vertex ", i / 3, " is not a finite number (", legible(word), ")");
      if (word.empty()) return;   // VTK says so
    }
  }

  void check(std::string_view list, Counts counts) const {
    long long used = 0;
    auto const incomplete = [&](long long cell) {
      fail(list, " announces ", counts.number, " cells, number ", cell, " is not complete; the file was cut short or is damaged");
    };
    for (long long cell = 0; cell < counts.number; ++cell) {
      auto const corners = take_integer(counts.rest);
      if (!corners || *corners < 0 || *corners >= counts.size - used) incomplete(cell);
      for (long long i = 0; i < *corners; ++i) {
        auto const corner = take_integer(counts.rest);
        if (!corner) incomplete(cell);
        if (*corner < 0 || *corner >= vertices_) throw FileError(no_such_vertex(name_, message(list, ": cell"), cell, *corner, vertices_));
      }
      used += *corners + 1;
    }
    if (used != counts.size) fail(list, " announces ", counts.size, " integers and holds ", used, "; the file is damaged");
  }

  void check_types(Counts counts) const {
    for (long long cell = 0; cell < counts.number; ++cell) {
      auto const type = take_integer(counts.rest);
      if (!type) fail("CELL_TYPES announces ", counts.number, " types, number ", cell, " is missing; the file was cut short or is damaged");
      if (*type == VTK_POLYHEDRON) fail("cell ", cell, " is a polyhedron (VTK's type 42), which is not read; divide it into tetrahedra");
    }
  }

  std::optional<long long> take_integer(std::string_view& rest) const noexcept {
    if (text_) return to_number<long long>(take_word(rest));
    if (rest.size() < 4) return std::nullopt;
    std::uint32_t value = 0;   // binary files are big-endian
    for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(rest[static_cast<std::size_t>(i)]);
    rest.remove_prefix(4);
    return static_cast<std::int32_t>(value);
  }

  std::string_view bytes_, rest_;   // all, and what follows the header
  std::string const& name_;
  std::string lower_;               // the latter in lower case
  long long vertices_ = 0;
  bool text_ = true;
};

/// The surface or grid of a legacy file, as LegacyCheck has it.
inline vtkSmartPointer<vtkDataSet> read_legacy(std::string_view bytes, std::string const& name, bool surface) {
  std::string checked = LegacyCheck{bytes, name}(surface);
  vtkNew<vtkCharArray> text;
  text->SetArray(checked.data(), static_cast<vtkIdType>(checked.size()), 1);   // 1: it stays ours
  vtkNew<vtkDataSetReader> reader;
  reader->SetInputArray(text);
  reader->ReadFromInputStringOn();
  reader->Update();
  return reader->GetOutput();
}

}  // namespace palpate::detail
