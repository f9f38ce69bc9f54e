#include "tpm/organ/body/obj_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>

#include "tpm/organ/body/mesh_coordinate.hpp"
#include "tpm/organ/body/mesh_polygon.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

constexpr std::string_view kBlank = " \t\v\f";

/// The statements of an OBJ text, taken apart into words.
class ObjStatements {
 public:
  explicit ObjStatements(std::string_view text) : text_(text) {
    if (text_.starts_with(kUtf8Mark)) at_ = kUtf8Mark.size();
  }

  /// Only vertices and faces keep their words. False at the end.
  bool next() {
    words_.clear();
    std::string_view line;
    if (!next_line(line)) return false;
    line_ = last_line_;
    bool goes_on = add_words(line);
    if (words_.empty() || (words_.front() != "v" && words_.front() != "f")) {
      words_.clear();
      return true;
    }
    while (goes_on && next_line(line)) goes_on = add_words(line);
    return true;
  }
  /// Empty for a statement that is neither a vertex nor a face.
  [[nodiscard]] std::span<const std::string_view> words() const { return words_; }
  /// On which the statement begins, from 1.
  [[nodiscard]] int line() const { return line_; }

 private:
  bool next_line(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = end + (text_.substr(end).starts_with("\r\n") ? 2 : 1);
    ++last_line_;
    return true;
  }
  /// "#" begins a comment where a word could begin: "1.#QNAN" is no 1.
  static std::string_view without_comment(std::string_view line) {
    for (std::size_t at = line.find('#'); at < line.size(); at = line.find('#', at + 1)) {
      if (at == 0 || kBlank.find(line[at - 1]) != std::string_view::npos) return line.substr(0, at);
    }
    return line;
  }
  /// True if the statement goes on in the next line.
  bool add_words(std::string_view line) {
    line = without_comment(line);
    line = line.substr(0, line.find_last_not_of(kBlank) + 1);
    const bool goes_on = line.ends_with('\\');
    if (goes_on) line.remove_suffix(1);
    while (true) {
      const std::size_t first = line.find_first_not_of(kBlank);
      if (first == std::string_view::npos) return goes_on;
      line.remove_prefix(first);
      const std::size_t end = std::min(line.find_first_of(kBlank), line.size());
      words_.push_back(line.substr(0, end));
      line.remove_prefix(end);
      if (words_.size() == 1 && words_.front() != "v" && words_.front() != "f") return false;
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int last_line_ = 0;
  int line_ = 0;
  std::vector<std::string_view> words_;
};

/// A whole number at the front of a word, taken off it.
std::optional<int> take_number(std::string_view& word) {
  int number = 0;
  const char* const first = word.data() + (word.starts_with('+') ? 1 : 0);
  const auto [end, fault] = std::from_chars(first, word.data() + word.size(), number);
  if (fault != std::errc()) return std::nullopt;
  word.remove_prefix(static_cast<std::size_t>(end - word.data()));
  return number;
}

/// The vertex that a corner such as "3", "3/1", "3//2" or "-1/1/2" names.
std::optional<int> vertex_number(std::string_view word) {
  const auto number = take_number(word);
  for (int part = 0; part < 2 && number && word.starts_with('/'); ++part) {
    word.remove_prefix(1);
    (void)take_number(word);  // of a texture, then of a normal
  }
  return word.empty() ? number : std::nullopt;
}

class ObjReader {
 public:
  ObjReader(std::string_view text, std::string_view where) : statements_(text), where_(where) {}

  MeshContents read() {
    while (statements_.next()) {
      if (statements_.words().empty()) continue;
      if (statements_.words().front() == "v") {
        add_vertex(statements_.words().subspan(1));
      } else {
        add_face(statements_.words().subspan(1));
      }
    }
    if (faces_.empty()) throw bad_input(where_, "holds no faces", "lines such as 'f 1 2 3'");
    return cut_faces();
  }

 private:
  struct Face {
    int line = 0;
    std::size_t end = 0;  ///< of its corners
  };

  [[nodiscard]] Error fault(int line, std::string_view what, std::string_view expected) const {
    return bad_input(fmt::format("{}:{}", where_, line), what, expected);
  }

  /// x y z; x y z w with a weight; x y z r g b and x y z r g b a with a colour.
  void add_vertex(std::span<const std::string_view> words) {
    constexpr std::string_view kExpected =
        "v and three coordinates, a weight or a colour behind them";
    if (words.size() != 3 && words.size() != 4 && words.size() != 6 && words.size() != 7) {
      throw fault(statements_.line(), fmt::format("a vertex of {} numbers", words.size()),
                  kExpected);
    }
    std::array<float, 4> numbers{};
    const std::size_t used = words.size() == 4 ? 4 : 3;
    for (std::size_t i = 0; i < used; ++i) {
      const auto number = find_mesh_coordinate(words[i]);
      if (!number) {
        throw fault(statements_.line(),
                    fmt::format("'{}' is no finite number", printable(words[i])), kExpected);
      }
      numbers[i] = *number;
    }
    MeshCorner vertex{numbers[0], numbers[1], numbers[2]};
    if (used == 4) {
      for (float& coordinate : vertex) coordinate /= numbers[3];
    }
    if (!std::all_of(vertex.begin(), vertex.end(), [](float x) { return std::isfinite(x); })) {
      throw fault(statements_.line(), fmt::format("a weight of {}", printable(words[3])),
                  "a weight by which the coordinates can be divided");
    }
    vertices_.push_back(vertex);
  }

  void add_face(std::span<const std::string_view> words) {
    if (words.size() > kMostPolygonCorners) {
      throw fault(statements_.line(), fmt::format("a face has {} corners", words.size()),
                  fmt::format("at most {}; triangles are best", kMostPolygonCorners));
    }
    for (const std::string_view word : words) {
      const auto number = vertex_number(word);
      if (!number || *number == 0) {
        throw fault(statements_.line(), fmt::format("'{}' names no corner", printable(word)),
                    "v, v/vt, v//vn or v/vt/vn with numbers from 1, or negative ones");
      }
      const int known = static_cast<int>(vertices_.size());
      const int vertex = *number > 0 ? *number - 1 : known + *number;
      if (vertex < 0) throw unknown_vertex(statements_.line(), *number, known);
      corners_.push_back(vertex);
    }
    faces_.push_back({statements_.line(), corners_.size()});
  }
  [[nodiscard]] Error unknown_vertex(int line, int number, int known) const {
    return fault(line, fmt::format("a face names vertex {} of {}", number, known),
                 "vertices that the file holds");
  }

  MeshContents cut_faces() {
    MeshContents contents;
    numbers_.assign(vertices_.size(), -1);
    std::vector<Eigen::Vector3i> triangles;
    triangles.reserve(faces_.size());
    std::size_t first = 0;
    std::size_t left_out = 0;
    for (const Face& face : faces_) {
      const auto corners = std::span(corners_).subspan(first, face.end - first);
      first = face.end;
      if (corners.size() < 3) {  // a loose point or line bounds nothing
        ++left_out;
        continue;
      }
      cut_face(face, corners, triangles);
    }
    if (left_out > 0) {
      contents.notes.push_back(
          {"faces_left_out",
           fmt::format("{} faces of fewer than three corners were left out", left_out)});
    }
    contents.mesh.vertices.resize(3, static_cast<Eigen::Index>(used_.size()));
    for (std::size_t v = 0; v < used_.size(); ++v) {
      const auto& [x, y, z] = vertices_[static_cast<std::size_t>(used_[v])];
      contents.mesh.vertices.col(static_cast<Eigen::Index>(v)) = Eigen::Vector3d(x, y, z);
    }
    contents.mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      contents.mesh.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
    }
    return contents;
  }
  void cut_face(const Face& face, std::span<const int> corners,
                std::vector<Eigen::Vector3i>& triangles) {
    polygon_.clear();
    for (const int vertex : corners) {
      const auto v = static_cast<std::size_t>(vertex);
      if (v >= vertices_.size()) {
        throw unknown_vertex(face.line, vertex + 1, static_cast<int>(vertices_.size()));
      }
      polygon_.push_back(vertices_[v]);
      if (numbers_[v] >= 0) continue;  // vertices are numbered as faces come to them
      numbers_[v] = static_cast<int>(used_.size());
      used_.push_back(vertex);
    }
    const std::vector<PolygonTriangle> cut = cut_polygon(polygon_);
    if (cut.empty()) {
      throw fault(face.line, "a face cannot be cut into triangles: its sides cross",
                  "a flat polygon whose sides do not cross");
    }
    for (const auto& [a, b, c] : cut) {
      const auto number = [&](int corner) {
        return numbers_[static_cast<std::size_t>(corners[static_cast<std::size_t>(corner)])];
      };
      triangles.emplace_back(number(a), number(b), number(c));
    }
  }

  ObjStatements statements_;
  std::string_view where_;
  std::vector<MeshCorner> vertices_;
  std::vector<int> corners_;  ///< of all faces one behind the other, vertices from 0
  std::vector<Face> faces_;
  std::vector<int> numbers_;  ///< of the vertices in the mesh, -1 while no face has named them
  std::vector<int> used_;     ///< vertices in the order of the mesh
  std::vector<MeshCorner> polygon_;
};

}  // namespace

MeshContents parse_obj(std::string_view bytes, std::string_view where) {
  return ObjReader(bytes, where).read();
}

}  // namespace tpm::organ
