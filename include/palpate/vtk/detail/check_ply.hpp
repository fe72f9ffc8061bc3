// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/vtk/detail/text_scanner.hpp>

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Throws `FileError` when a PLY file holds fewer values than its header announces: VTK would go on with values of its own.
class PlyCheck {
 public:
  PlyCheck(std::string_view bytes, std::string const& name) : rest_(bytes), name_(name) {}

  void operator()() {
    read_header();
    for (Element const& element : elements_)
      for (long long i = 0; i < element.count; ++i) {
        line_ = text_ ? take_line(rest_) : std::string_view{};   // in a text file, an element is a line
        for (Property const& property : element.properties)
          if (!skip(property))
            throw FileError(message(name_, ": the header announces ", element.count, " of \"", element.name, "\", number ", i,
                                    " is not complete; the file was cut short or is damaged"));
      }
  }

 private:
  struct Property {
    std::size_t bytes = 0;         // of a value
    std::size_t length_bytes = 0;  // of a list's length; 0: not a list
    bool length_is_signed = false;
  };
  struct Element {
    std::string name;
    long long count = 0;
    std::vector<Property> properties;
  };

  std::size_t bytes_of(std::string_view type) const {
    constexpr std::array<std::pair<std::string_view, std::size_t>, 16> sizes{
        {{"char", 1}, {"uchar", 1}, {"int8", 1}, {"uint8", 1}, {"short", 2}, {"ushort", 2}, {"int16", 2}, {"uint16", 2},
         {"int", 4}, {"uint", 4}, {"int32", 4}, {"uint32", 4}, {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}}};
    for (auto const& [known, size] : sizes)
      if (known == type) return size;
    throw FileError(message(name_, ": \"", type, "\" is not a type of a PLY property"));
  }

  void read_header() {
    if (take_line(rest_) != "ply") throw FileError(message(name_, ": a PLY file begins with a line \"ply\""));
    for (;;) {
      if (rest_.empty()) throw FileError(message(name_, ": there is no \"end_header\"; the file was cut short"));
      std::string_view line = take_line(rest_);
      std::string_view const keyword = take_word(line);
      if (keyword == "end_header") return;
      if (keyword == "format") read_format(take_word(line));
      if (keyword == "element") {
        std::string const element(take_word(line));
        auto const count = parse_number<long long>(take_word(line));
        if (!count || *count < 0) throw FileError(message(name_, ": the element \"", element, "\" has no number"));
        elements_.push_back({element, *count, {}});
      }
      if (keyword == "property") read_property(line);
    }
  }

  void read_format(std::string_view format) {
    if (format != "ascii" && format != "binary_little_endian" && format != "binary_big_endian")
      throw FileError(message(name_, ": \"", format, "\" is not a PLY format"));
    text_ = format == "ascii";
    little_ = format == "binary_little_endian";
  }

  void read_property(std::string_view line) {
    if (elements_.empty()) throw FileError(message(name_, ": a property stands before the first element"));
    Property property;
    std::string_view type = take_word(line);
    if (type == "list") {
      type = take_word(line);
      property.length_bytes = bytes_of(type);
      property.length_is_signed = !type.starts_with('u');
      type = take_word(line);
    }
    property.bytes = bytes_of(type);
    elements_.back().properties.push_back(property);
  }

  /// Passes over one property; false at the end of the file.
  bool skip(Property const& property) {
    long long count = 1;
    if (text_) {
      if (property.length_bytes != 0) {
        auto const length = parse_number<long long>(take_word(line_));
        if (!length || *length < 0) return false;
        count = *length;
      }
      for (long long i = 0; i < count; ++i)
        if (take_word(line_).empty()) return false;
      return true;
    }
    if (property.length_bytes != 0) {
      if (rest_.size() < property.length_bytes) return false;
      count = integer(rest_.substr(0, property.length_bytes));
      rest_.remove_prefix(property.length_bytes);
    }
    if (count < 0 || static_cast<std::size_t>(count) > rest_.size() / property.bytes) return false;
    rest_.remove_prefix(static_cast<std::size_t>(count) * property.bytes);
    return true;
  }

  long long integer(std::string_view bytes) const noexcept {
    unsigned long long value = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i)
      value = value << 8 | static_cast<unsigned char>(bytes[little_ ? bytes.size() - 1 - i : i]);
    return static_cast<long long>(value);
  }

  std::string_view rest_, line_;
  std::string const& name_;
  std::vector<Element> elements_;
  bool text_ = true;
  bool little_ = true;
};

}  // namespace palpate::detail
