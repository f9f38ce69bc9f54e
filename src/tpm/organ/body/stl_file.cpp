#include "tpm/organ/body/stl_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "tpm/organ/body/mesh_coordinate.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kCountBytes = 4;
constexpr std::size_t kFirstTriangle = kHeaderBytes + kCountBytes;
constexpr std::size_t kNormalBytes = 12;
constexpr std::size_t kTriangleBytes = 50;
constexpr std::size_t kSample = 1024;  ///< bytes in which a binary file shows that it is no text

char lower_case(char letter) {
  return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
}

bool is_word(std::string_view text, std::string_view word) {
  return std::equal(text.begin(), text.end(), word.begin(), word.end(),
                    [](char a, char b) { return lower_case(a) == b; });
}

bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}

bool is_space(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

bool is_text(std::string_view bytes) {
  bytes = bytes.substr(0, kSample);
  return std::all_of(bytes.begin(), bytes.end(), [](char c) {
    const auto u = static_cast<unsigned char>(c);
    return u >= 0x20 ? u != 0x7f : is_space(c);
  });
}

TriangleMesh mesh_of_corners(const std::vector<MeshCorner>& corners) {
  TriangleMesh mesh;
  const auto count = static_cast<Eigen::Index>(corners.size());
  mesh.vertices.resize(3, count);
  for (Eigen::Index c = 0; c < count; ++c) {
    const auto& [x, y, z] = corners[static_cast<std::size_t>(c)];
    mesh.vertices.col(c) = Eigen::Vector3d(x, y, z);
  }
  mesh.triangles.resize(3, count / 3);
  for (Eigen::Index c = 0; c < count; ++c) mesh.triangles(c % 3, c / 3) = static_cast<int>(c);
  return mesh;
}

/// The words of a text STL, one after another.
class StlText {
 public:
  StlText(std::string_view text, std::string_view where) : text_(text), where_(where) {
    if (text_.starts_with(kUtf8Mark)) at_ = kUtf8Mark.size();
  }

  MeshContents read() {
    while (is_word(peek(), "solid")) read_solid();
    if (!peek().empty()) {
      const std::size_t rest = text_.size() - (at_ - word_.size());
      notes_.push_back(
          {"bytes_left_out", fmt::format("{} bytes behind the last solid were left out", rest)});
    }
    if (corners_.empty()) throw bad_input(where_, "holds no triangles", "a closed surface");
    return {mesh_of_corners(corners_), std::move(notes_)};
  }

 private:
  /// The next word, which stays the next; empty at the end of the text.
  std::string_view peek() {
    if (!word_.empty()) return word_;
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
    const std::size_t first = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return word_ = text_.substr(first, at_ - first);
  }
  std::string_view take() {
    const std::string_view word = peek();
    word_ = {};
    return word;
  }
  [[nodiscard]] Error fault(std::string_view what, std::string_view expected) const {
    const std::size_t byte = at_ - std::min(at_, word_.size());
    return bad_input(fmt::format("{}:{}", where_, line_of_byte(text_, byte)), what, expected);
  }
  void expect(std::string_view wanted, std::string_view of) {
    const std::string_view word = peek();
    if (is_word(word, wanted)) {
      take();
      return;
    }
    throw fault(word.empty() ? fmt::format("the file ends inside {}", of)
                             : fmt::format("'{}' inside {}", printable(word), of),
                fmt::format("'{}'", wanted));
  }
  /// The rest of the line is a name.
  void skip_line() {
    while (at_ < text_.size() && !is_line_end(text_[at_])) ++at_;
  }

  void read_solid() {
    take();
    skip_line();
    while (true) {
      const std::string_view word = peek();
      if (word.empty()) {
        notes_.push_back(
            {"no_endsolid", "the last solid has no 'endsolid'; the file may have been cut off"});
        return;
      }
      if (is_word(word, "endsolid")) {
        take();
        skip_line();
        return;
      }
      if (is_word(word, "facet")) {
        read_facet();
      } else if (is_word(word, "color") || word.starts_with('#')) {
        take();
        skip_line();
      } else {
        throw fault(fmt::format("'{}' where a facet should begin", printable(word)),
                    "'facet' or 'endsolid'");
      }
    }
  }
  void read_facet() {
    take();
    if (is_word(peek(), "normal")) {
      for (int i = 0; i < 4 && !is_word(peek(), "outer"); ++i) take();
    }
    expect("outer", "a facet");
    expect("loop", "a facet");
    for (int i = 0; i < 3; ++i) read_vertex();
    if (is_word(peek(), "vertex")) throw fault("a facet has a fourth vertex", "triangles");
    expect("endloop", "a facet");
    expect("endfacet", "a facet");
  }
  void read_vertex() {
    expect("vertex", "a facet");
    MeshCorner corner{};
    for (float& coordinate : corner) {
      const auto number = find_mesh_coordinate(peek());
      if (!number) {
        throw fault(peek().empty() ? "the file ends inside a vertex"
                                   : fmt::format("'{}' is no finite number", printable(peek())),
                    "three coordinates behind 'vertex'");
      }
      coordinate = *number;
      take();
    }
    corners_.push_back(corner);
  }

  std::string_view text_;
  std::string_view where_;
  std::string_view word_;  ///< looked at and not taken; empty if there is none
  std::size_t at_ = 0;     ///< behind the last word that was looked at
  std::vector<MeshCorner> corners_;
  std::vector<Remark> notes_;
};

MeshContents parse_binary(std::string_view bytes, std::uint32_t count, std::string_view where) {
  if (count == 0) {
    throw bad_input(fmt::format("{}: byte {}", where, kHeaderBytes),
                    "the header says that there are no triangles", "a closed surface");
  }
  const std::size_t end = kFirstTriangle + std::size_t{count} * kTriangleBytes;
  if (bytes.size() < end) {
    throw bad_input(
        fmt::format("{}: byte {}", where, kHeaderBytes),
        fmt::format("the header says {} triangles, which end at byte {}; the file has {} bytes",
                    count, end, bytes.size()),
        "a whole file in binary STL, or text that begins with 'solid'");
  }
  std::vector<MeshCorner> corners(3 * std::size_t{count});
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const std::size_t at =
        kFirstTriangle + c / 3 * kTriangleBytes + kNormalBytes + c % 3 * sizeof(MeshCorner);
    std::memcpy(corners[c].data(), bytes.data() + at, sizeof(MeshCorner));
    if (!std::all_of(corners[c].begin(), corners[c].end(),
                     [](float x) { return std::isfinite(x); })) {
      throw bad_input(fmt::format("{}: byte {}", where, at),
                      fmt::format("corner {} of triangle {} is not finite", c % 3 + 1, c / 3 + 1),
                      "finite coordinates");
    }
  }
  MeshContents contents{mesh_of_corners(corners), {}};
  if (bytes.size() > end) {
    contents.notes.push_back(
        {"bytes_left_out",
         fmt::format("{} bytes behind the last triangle were left out", bytes.size() - end)});
  }
  return contents;
}

}  // namespace

MeshContents parse_stl(std::string_view bytes, std::string_view where) {
  std::string_view start = bytes;
  if (start.starts_with(kUtf8Mark)) start.remove_prefix(kUtf8Mark.size());
  while (!start.empty() && is_space(start.front())) start.remove_prefix(1);
  const bool says_solid =
      is_word(start.substr(0, 5), "solid") && (start.size() == 5 || is_space(start[5]));
  const bool text = is_text(bytes);
  if (says_solid && text) return StlText(bytes, where).read();
  if (text || bytes.size() < kFirstTriangle) {
    throw bad_input(where,
                    text ? "is text that does not begin with 'solid'"
                         : fmt::format("has {} bytes, fewer than a header", bytes.size()),
                    "STL: text that begins with 'solid', or the binary form");
  }
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeaderBytes, kCountBytes);  // little-endian, as this machine
  return parse_binary(bytes, count, where);
}

}  // namespace tpm::organ
