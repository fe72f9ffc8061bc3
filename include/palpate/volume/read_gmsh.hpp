// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/volume/detail/given_tetrahedra.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace palpate {

/// A physical group of volumes in a Gmsh file, as a material is given by: `tissue.set_material(group.tetrahedra, material)`.
struct GmshGroup {
  long long tag = 0;
  std::string name;              ///< empty where the file has none
  std::vector<int> tetrahedra;   ///< of the mesh that read_gmsh makes of the file, rising
};

namespace detail {

/// The tetrahedra of a Gmsh file in ASCII. Vertices keep their order; their tags are looked up.
class GmshScan {
 public:
  /// `text` and `name` must outlive the object.
  GmshScan(std::string_view text, std::string const& name) : rest_(text), size_(text.size()), name_(name) {}

  TetrahedralMesh<double> mesh(std::optional<double> metres_per_unit) {
    scan();
    return given_tetrahedra(points_, tetrahedra_, metres_per_unit, name_);
  }
  std::vector<GmshGroup> groups() {
    groups_wanted_ = true;
    scan();
    std::vector<GmshGroup> result;
    for (auto& [tag, group] : groups_) {
      group.tag = tag;
      result.push_back(std::move(group));
    }
    return result;
  }

 private:
  void scan() {
    bool nodes = false, elements = false;
    for (std::string_view line; next(line);) {
      std::string_view const keyword = take_word(line);
      if (keyword == "$MeshFormat") {
        read_format();
      } else if (groups_wanted_ && keyword == "$PhysicalNames") {
        read_names();
      } else if (groups_wanted_ && keyword == "$Entities") {
        read_entities();
      } else if (keyword == "$NOD" || keyword == "$Nodes") {
        if (nodes) fail("vertices are given twice");
        version_ = keyword == "$NOD" ? 1 : version_;
        require_version();
        version_ == 4 ? read_blocks_of_nodes() : read_nodes();
        nodes = true;
      } else if (keyword == "$ELM" || keyword == "$Elements") {
        if (!nodes) fail("elements come before vertices");
        if (elements) fail("elements are given twice");
        if ((keyword == "$ELM") != (version_ == 1)) fail("\"", keyword, "\" does not go with the vertices before");
        version_ == 4 ? read_blocks_of_elements() : read_elements();
        elements = true;
      } else if (keyword.starts_with('$') && !keyword.starts_with("$End") && !keyword.starts_with("$END")) {
        skip(keyword);
      } else if (!keyword.empty() && !keyword.starts_with('$')) {
        fail("\"", legible(keyword), "\" stands outside of any section; is it a Gmsh file?");
      }
    }
    if (!nodes) throw FileError(message(name_, ": there are no vertices ($Nodes or $NOD) in this file; is it a Gmsh file?"));
    if (!elements) throw FileError(message(name_, ": there are no elements ($Elements or $ELM) in this file; was it cut short?"));
  }

  template <class... Parts>
  [[noreturn]] void fail(Parts const&... parts) const {
    throw FileError(message(name_, ", line ", line_, ": ", parts...));
  }

  /// Of a number or a vertex: sections go on to their $End...
  template <class... Parts>
  [[noreturn]] void fail_in_section(Parts const&... parts) const {
    fail(parts..., rest_.empty() ? "; the file ends in this line, it was cut short" : "");
  }

  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    line = take_line(rest_);
    ++line_;
    return true;
  }
  std::string_view next(char const* what) {
    std::string_view line;
    bool found = next(line);
    while (found && trimmed(line).empty()) found = next(line);
    if (!found) fail("the file ends where ", what, " should be; it was cut short");
    return line;
  }
  long long whole(std::string_view& line, char const* what) const {
    std::string_view const word = take_word(line);
    auto const value = to_number<long long>(word);
    if (!value) fail_in_section(word.empty() ? "nothing" : "\"" + legible(word) + "\"", " stands where ", what, " should be");
    return *value;
  }
  /// The tag of a physical group. Gmsh writes −tag where an entity is turned over in it.
  long long group_tag(std::string_view& line, char const* what) const {
    long long const tag = whole(line, what);
    return tag < 0 ? -std::max(tag, -std::numeric_limits<long long>::max()) : tag;
  }
  /// A number of things that each take a byte at least.
  long long count(std::string_view& line, char const* what) const {
    long long const value = whole(line, what);
    if (value < 0 || value > static_cast<long long>(size_)) fail(what, " is ", value, ", which this file can not hold; it was cut short or is damaged");
    return value;
  }
  void end(std::string_view expected) {
    std::string_view line = next(version_ == 1 ? "the end of the section" : "$End...");
    if (take_word(line) != expected) fail("\"", expected, "\" should be here; more stands in the section than it announces");
  }
  void skip(std::string_view keyword) {
    std::string const wanted = "$End" + std::string(keyword.substr(1));
    for (std::string_view line; next(line);)
      if (take_word(line) == wanted) return;
    fail("the section ", legible(keyword), " has no end; the file was cut short");
  }

  void read_format() {
    std::string_view line = next("the version");
    std::string_view const number = take_word(line);
    auto const version = to_number<double>(number);
    long long const binary = whole(line, "the file type");
    if (binary != 0) fail("this is a binary Gmsh file; save it as ASCII (Mesh.Binary = 0)");
    if (!version || !((*version >= 2 && *version < 3) || *version == 4.1))
      fail("version \"", legible(number), "\" is not read; save it as 2.2 or 4.1 (Mesh.MshFileVersion)");
    version_ = *version < 3 ? 2 : 4;
    end("$EndMeshFormat");
  }
  void require_version() const {
    if (version_ == 0) fail("there is no $MeshFormat before the vertices");
  }

  void add_tag(long long tag) {
    if (!index_.emplace(tag, static_cast<int>(index_.size())).second) fail("vertex ", tag, " is there twice");
  }
  void add_point(std::string_view& line) {
    Vector3<double> p;
    for (int k = 0; k < 3; ++k) {
      std::string_view const word = take_word(line);
      auto const value = to_number<double>(word);
      if (word.empty()) fail_in_section("nothing stands where a coordinate should be");
      if (!value || !std::isfinite(*value)) fail_in_section("\"", legible(word), "\" is not a coordinate");
      p[k] = *value;
    }
    points_.push_back(p);
  }
  /// `groups`: the tags of those that the element is in, 0 for none.
  void add_element(long long type, std::string_view& line, std::vector<long long> const& groups) {
    if (type == 4) {
      std::array<int, 4> corners;
      for (int& corner : corners) {
        long long const tag = whole(line, "a corner of a tetrahedron");
        auto const found = index_.find(tag);
        if (found == index_.end()) fail_in_section("a tetrahedron names vertex ", tag, ", which the file does not have");
        corner = found->second;
      }
      if (std::string_view const more = take_word(line); !more.empty()) fail("\"", legible(more), "\" follows the four corners of a tetrahedron; the number of tags does not fit");
      if (groups_wanted_)
        for (long long const group : groups)
          if (group != 0) groups_[group].tetrahedra.push_back(static_cast<int>(tetrahedra_.size()));
      tetrahedra_.push_back(corners);
      return;
    }
    constexpr std::array flat{1, 2, 3, 8, 9, 10, 15, 16, 20, 21, 22, 23, 24, 25, 26, 27, 28};   // points, lines and faces
    if (std::find(flat.begin(), flat.end(), type) == flat.end())
      fail("an element of type ", type, " is no tetrahedron of four vertices; mesh with tetrahedra of first order (Mesh.ElementOrder = 1)");
  }

  void read_names() {
    std::string_view line = next("the number of physical names");
    long long const n = count(line, "the number of physical names");
    for (long long i = 0; i < n; ++i) {
      line = next("a physical name");
      long long const dimension = whole(line, "the dimension of a physical group"), tag = whole(line, "the tag of a physical group");
      auto const begin = line.find('"'), end = line.rfind('"');
      if (begin == end) fail_in_section("the physical group ", tag, " has no name in quotes");
      if (dimension == 3) groups_[tag].name = line.substr(begin + 1, end - begin - 1);
    }
    end("$EndPhysicalNames");
  }
  void read_entities() {
    std::string_view line = next("the numbers of entities");
    long long others = 0;
    for (int dimension = 0; dimension < 3; ++dimension) others += count(line, "the number of entities");
    long long const volumes = count(line, "the number of volumes");
    for (long long i = 0; i < others; ++i) next("an entity");
    for (long long i = 0; i < volumes; ++i) {
      line = next("a volume");
      auto& groups = groups_of_volume_[whole(line, "the tag of a volume")];
      for (int k = 0; k < 6; ++k) take_word(line);   // its box
      for (long long k = count(line, "the number of physical groups"); k > 0; --k)
        groups.push_back(group_tag(line, "the tag of a physical group"));
      std::sort(groups.begin(), groups.end());   // a volume, or a group of it, may be listed twice
      groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    }
    end("$EndEntities");
  }

  void read_nodes() {
    std::string_view line = next("the number of vertices");
    long long const n = count(line, "the number of vertices");
    for (long long i = 0; i < n; ++i) {
      line = next("a vertex");
      add_tag(whole(line, "the tag of a vertex"));
      add_point(line);
    }
    end(version_ == 1 ? "$ENDNOD" : "$EndNodes");
  }
  void read_elements() {
    std::string_view line = next("the number of elements");
    long long const n = count(line, "the number of elements");
    std::vector<long long> groups(1);
    for (long long i = 0; i < n; ++i) {
      line = next("an element");
      whole(line, "the tag of an element");
      long long const type = whole(line, "the type of an element");
      long long const tags = version_ == 1 ? 3 : count(line, "the number of tags");   // of the first: two regions and the number of vertices
      groups[0] = 0;
      for (long long k = 0; k < tags; ++k)
        if (long long const tag = group_tag(line, "a tag"); k == 0) groups[0] = tag;
      add_element(type, line, groups);
    }
    end(version_ == 1 ? "$ENDELM" : "$EndElements");
  }

  void read_blocks_of_nodes() {
    std::string_view line = next("the number of blocks");
    long long const blocks = count(line, "the number of blocks"), n = count(line, "the number of vertices");
    for (long long b = 0; b < blocks; ++b) {
      line = next("a block of vertices");
      for (int k = 0; k < 3; ++k) whole(line, "the dimension, the tag or the kind of a block");
      long long const own = count(line, "the number of vertices of a block");
      for (long long i = 0; i < own; ++i) {
        line = next("the tag of a vertex");
        add_tag(whole(line, "the tag of a vertex"));
      }
      for (long long i = 0; i < own; ++i) {
        line = next("a vertex");
        add_point(line);
      }
    }
    if (static_cast<long long>(points_.size()) != n) fail(n, " vertices are announced and ", points_.size(), " given");
    end("$EndNodes");
  }
  void read_blocks_of_elements() {
    std::string_view line = next("the number of blocks");
    long long const blocks = count(line, "the number of blocks"), n = count(line, "the number of elements");
    long long given = 0;
    for (long long b = 0; b < blocks; ++b) {
      line = next("a block of elements");
      whole(line, "the dimension of a block");
      long long const entity = whole(line, "the tag of a block");
      long long const type = whole(line, "the type of elements"), own = count(line, "the number of elements of a block");
      auto const volume = groups_of_volume_.find(entity);
      bool const known = volume != groups_of_volume_.end();
      if (groups_wanted_ && type == 4 && !known)
        fail("the tetrahedra of volume ", entity, " have no groups: $Entities does not list it; save with $Entities, not in parts");
      std::vector<long long> const groups = known ? volume->second : std::vector<long long>{};
      for (long long i = 0; i < own; ++i, ++given) {
        line = next("an element");
        whole(line, "the tag of an element");
        add_element(type, line, groups);
      }
    }
    if (given != n) fail(n, " elements are announced and ", given, " given");
    end("$EndElements");
  }

  std::string_view rest_;
  std::size_t size_;
  std::string const& name_;
  long long line_ = 0;
  int version_ = 0;   // 1, 2 or 4
  std::vector<Vector3<double>> points_;
  std::unordered_map<long long, int> index_;
  std::vector<std::array<int, 4>> tetrahedra_;
  bool groups_wanted_ = false;
  std::map<long long, GmshGroup> groups_;                                    // by their tags
  std::unordered_map<long long, std::vector<long long>> groups_of_volume_;   // of version 4
};

}  // namespace detail

/// The tetrahedra in the text of a Gmsh file; `name` opens messages. See read_gmsh.
template <RealScalar Scalar = double>
TetrahedralMesh<Scalar> parse_gmsh(std::string_view text, std::optional<double> metres_per_unit = {}, std::string const& name = "Gmsh text") {
  detail::stated_or_metres(metres_per_unit);
  auto const mesh = detail::GmshScan(text, name).mesh(metres_per_unit);
  return {mesh.points.template cast<Scalar>(), mesh.tetrahedra};
}

/// Reads the tetrahedra of a Gmsh file in ASCII, of version 1, 2.x or 4.1. Points, lines and faces in it are passed over, as are sections of other things.
///   point [m] = point in the file · metres_per_unit; see `metres_per("mm")`. Not given, it is 1, and a file that is longer than 12 m is refused.
/// Tetrahedra that are inside out are turned, vertices of none are dropped; the rest keeps its order: tetrahedron k is the k-th of the file.
/// Throws `FileError` in one line with the line of the file: cut short, damaged, binary, of another version, volumes that are
/// no tetrahedra of four vertices, a coordinate that is not finite; with the numbers of tetrahedra and vertices, from 0 in the
/// order of the file: tetrahedra that are flat, name a vertex twice, are there twice or overlap at a face that they share;
/// more than two at a face; vertices that coincide.
template <RealScalar Scalar = double>
TetrahedralMesh<Scalar> read_gmsh(std::filesystem::path const& file, std::optional<double> metres_per_unit = {}) {
  return parse_gmsh<Scalar>(detail::read_whole_file(file), metres_per_unit, file.string());
}

/// The physical groups of volumes in the text of a Gmsh file. See read_gmsh_groups.
inline std::vector<GmshGroup> parse_gmsh_groups(std::string_view text, std::string const& name = "Gmsh text") { return detail::GmshScan(text, name).groups(); }

/// The physical groups of volumes in a Gmsh file, by rising tags, with the numbers of their tetrahedra in the mesh that read_gmsh makes of it,
/// each once. What Gmsh writes as −tag, of a volume that is turned over, is of group tag.
/// Throws `FileError` in one line where read_gmsh does for the text, and where a file of version 4.1 does not say in which groups its tetrahedra are.
inline std::vector<GmshGroup> read_gmsh_groups(std::filesystem::path const& file) {
  return parse_gmsh_groups(detail::read_whole_file(file), file.string());
}

}  // namespace palpate
