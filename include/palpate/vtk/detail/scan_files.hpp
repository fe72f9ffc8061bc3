// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/vtk/detail/check_files.hpp>

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
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
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
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
        if (!number) fail(line_number, "\"", legible(word), "\" is not a coordinate");
        coordinate = *number;
      }
      points->InsertNextPoint(x);
    } else if (keyword == "f") {
      corners.clear();
      for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
        if (word.starts_with('#')) break;
        auto const index = to_number<long long>(word.substr(0, word.find('/')));
        if (!index || *index == 0) fail(line_number, "\"", legible(word), "\" is not a corner of a face");
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

/// Reads the vertices and faces of a PLY file, text or binary, in the order of the file; everything else is passed over.
/// VTK's own reader follows a damaged header or a file that was cut short into memory that is not its own.
class PlyScan {
 public:
  /// `bytes` and `name` must outlive the object.
  PlyScan(std::string_view bytes, std::string const& name) : rest_(bytes), name_(name) {}

  /// Throws `FileError` for anything that is not what the header announces.
  vtkSmartPointer<vtkPolyData> operator()() {
    read_header();
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkCellArray> faces;
    std::vector<vtkIdType> corners;
    for (Element const& element : elements_) {
      if (element.properties.empty()) continue;
      for (long long i = 0; i < element.count; ++i) {
        line_ = text_ ? take_line(rest_) : std::string_view{};   // in a text file, an element is a line
        double x[3]{};
        for (Property const& property : element.properties) {
          bool const list = property.length_type != Type::none;
          auto const length = list ? take(property.length_type) : 1.0;
          bool complete = length && *length >= 0;
          if (property.role == Role::corners) corners.clear();
          for (double k = 0; complete && k < *length; ++k) {
            auto const value = take(property.type);
            complete = value.has_value();
            if (!complete) break;
            if (property.role == Role::corners)
              corners.push_back(corner(i, *value));
            else if (property.role != Role::none)
              x[static_cast<int>(property.role)] = *value;
          }
          if (!complete)
            throw FileError(message(name_, ": the header announces ", element.count, " of \"", legible(element.name), "\", number ", i,
                                    " is not complete; the file was cut short or is damaged"));
        }
        if (element.name == "vertex") points->InsertNextPoint(x);
        if (element.name == "face" && corners.size() >= 3)
          faces->InsertNextCell(static_cast<vtkIdType>(corners.size()), corners.data());
      }
    }
    auto surface = vtkSmartPointer<vtkPolyData>::New();
    surface->SetPoints(points);
    surface->SetPolys(faces);
    return surface;
  }

 private:
  enum class Type { none, int8, uint8, int16, uint16, int32, uint32, float32, float64 };
  enum class Role { x, y, z, corners, none };   // the first three count the coordinates

  struct Property {
    Type type;                       // of a value
    Type length_type = Type::none;   // of a list's length; none: not a list
    Role role = Role::none;
  };
  struct Element {
    std::string name;
    long long count = 0;
    std::vector<Property> properties;
  };

  Type type_of(std::string_view name) const {
    constexpr std::array<std::pair<std::string_view, Type>, 16> types{
        {{"char", Type::int8}, {"int8", Type::int8}, {"uchar", Type::uint8}, {"uint8", Type::uint8},
         {"short", Type::int16}, {"int16", Type::int16}, {"ushort", Type::uint16}, {"uint16", Type::uint16},
         {"int", Type::int32}, {"int32", Type::int32}, {"uint", Type::uint32}, {"uint32", Type::uint32},
         {"float", Type::float32}, {"float32", Type::float32}, {"double", Type::float64}, {"float64", Type::float64}}};
    for (auto const& [known, type] : types)
      if (known == name) return type;
    throw FileError(message(name_, ": \"", legible(name), "\" is not a type of a PLY property"));
  }

  vtkIdType corner(long long face, double value) const {
    bool const whole = std::floor(value) == value;
    if (whole && value >= 0 && value < static_cast<double>(vertices_)) return static_cast<vtkIdType>(value);
    std::string shown;
    append_number(shown, value);
    throw FileError(whole ? no_such_vertex(name_, "face", face, shown, vertices_) : message(name_, ": face ", face, " refers to vertex ", shown, "; write a whole number"));
  }

  void read_header() {
    if (rest_.starts_with(byte_order_mark)) rest_.remove_prefix(byte_order_mark.size());
    if (take_line(rest_) != "ply") throw FileError(message(name_, ": a PLY file begins with a line \"ply\""));
    for (;;) {
      if (rest_.empty()) throw FileError(message(name_, ": there is no \"end_header\"; the file was cut short"));
      std::string_view line = take_line(rest_);
      std::string_view const keyword = take_word(line);
      if (keyword == "end_header") break;
      if (keyword == "format") read_format(take_word(line));
      if (keyword == "element") {
        std::string const element(take_word(line));
        auto const count = to_number<long long>(take_word(line));
        if (!count || *count < 0 || *count > static_cast<long long>(rest_.size()))   // each takes a byte at least
          throw FileError(message(name_, ": the element \"", legible(element), "\" has no fitting number; the file was cut short or is damaged"));
        elements_.push_back({element, *count, {}});
      }
      if (keyword == "property") read_property(line);
    }
    for (Element const& element : elements_) {
      if (element.name != "vertex") continue;
      vertices_ += element.count;
      for (Role const role : {Role::x, Role::y, Role::z})
        if (std::ranges::none_of(element.properties, [&](Property const& property) { return property.role == role; }))
          throw FileError(message(name_, ": a vertex has no property \"", std::string(1, static_cast<char>('x' + static_cast<int>(role))), "\"; it needs x, y and z"));
    }
  }

  void read_format(std::string_view format) {
    if (format != "ascii" && format != "binary_little_endian" && format != "binary_big_endian")
      throw FileError(message(name_, ": \"", legible(format), "\" is not a PLY format"));
    text_ = format == "ascii";
    little_ = format == "binary_little_endian";
  }

  void read_property(std::string_view line) {
    if (elements_.empty()) throw FileError(message(name_, ": a property stands before the first element"));
    Property property{};
    std::string_view type = take_word(line);
    bool const list = type == "list";
    if (list) {
      property.length_type = type_of(take_word(line));
      type = take_word(line);
    }
    property.type = type_of(type);
    std::string_view const name = take_word(line);
    bool const vertex = elements_.back().name == "vertex" && !list;
    if (vertex && name == "x") property.role = Role::x;
    if (vertex && name == "y") property.role = Role::y;
    if (vertex && name == "z") property.role = Role::z;
    if (elements_.back().name == "face" && list && (name == "vertex_indices" || name == "vertex_index")) property.role = Role::corners;
    elements_.back().properties.push_back(property);
  }

  /// The next value, or nothing at the end of the file or line.
  std::optional<double> take(Type type) noexcept {
    if (text_) return to_number<double>(take_word(line_));
    switch (type) {
      case Type::int8: return take_binary<std::int8_t>();
      case Type::uint8: return take_binary<std::uint8_t>();
      case Type::int16: return take_binary<std::int16_t>();
      case Type::uint16: return take_binary<std::uint16_t>();
      case Type::int32: return take_binary<std::int32_t>();
      case Type::uint32: return take_binary<std::uint32_t>();
      case Type::float32: return take_binary<float>();
      case Type::float64: return take_binary<double>();
      case Type::none: break;
    }
    return std::nullopt;
  }

  template <class Value>
  std::optional<double> take_binary() noexcept {
    std::array<char, sizeof(Value)> bytes;
    if (rest_.size() < bytes.size()) return std::nullopt;
    std::copy_n(rest_.begin(), bytes.size(), bytes.begin());
    rest_.remove_prefix(bytes.size());
    if (little_ != (std::endian::native == std::endian::little)) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<Value>(bytes));
  }

  std::string_view rest_, line_;
  std::string const& name_;
  std::vector<Element> elements_;
  long long vertices_ = 0;
  bool text_ = true;
  bool little_ = true;
};

}  // namespace palpate::detail
