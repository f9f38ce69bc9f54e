// STL and OBJ as people have them: each is read as the body it describes, or refused with its line
// or byte.
#include <fmt/format.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "mesh_bytes.hpp"
#include "tpm/organ/body/mesh_coordinate.hpp"
#include "tpm/organ/body/mesh_polygon.hpp"
#include "tpm/organ/body/obj_file.hpp"
#include "tpm/organ/body/stl_file.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::organ;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using Eigen::Vector3d;

namespace {

/// The unit cube in mm: 8 vertices, 12 triangles.
void require_cube(const ClosedMesh& cube, const std::string& name) {
  INFO(name);
  CHECK(cube.mesh.vertices.cols() == 8);
  CHECK(cube.mesh.triangles.cols() == 12);
  CHECK_THAT(mesh_volume(cube.mesh), WithinRel(1e-9, 1e-12));
  CHECK_THAT(mesh_area(cube.mesh), WithinRel(6e-6, 1e-12));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string capitals(std::string text) {
  for (char& letter : text) {
    if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
  }
  return text;
}

const std::string kMark = "\xEF\xBB\xBF";
const std::string kCorners =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n";
const std::string kFaces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

/// The same faces with corners written in another way.
std::string cube_faces(const std::function<std::string(int)>& corner) {
  std::string text;
  for (const auto& face : {std::array{1, 3, 4, 2},
                           {5, 6, 8, 7},
                           {1, 2, 6, 5},
                           {3, 7, 8, 4},
                           {1, 5, 7, 3},
                           {2, 4, 8, 6}}) {
    text += "f";
    for (const int vertex : face) text += " " + corner(vertex);
    text += "\n";
  }
  return text;
}

std::string with_count(std::string bytes, std::uint32_t count) {
  std::memcpy(bytes.data() + 80, &count, sizeof count);
  return bytes;
}

std::string with_coordinate(std::string bytes, std::size_t at, float value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

std::string obj_refusal(const std::string& text) {
  return refusal_of([&] { (void)parse_obj(text, "m.obj"); });
}

std::string stl_refusal(const std::string& bytes) {
  return refusal_of([&] { (void)parse_stl(bytes, "m.stl"); });
}

double area_of(const MeshCorner& a, const MeshCorner& b, const MeshCorner& c) {
  const auto at = [](const MeshCorner& p) { return Vector3d(p[0], p[1], p[2]); };
  return 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).z();
}

/// Of triangles in the plane z = 0; each has to have area.
double area_of(const std::vector<MeshCorner>& corners,
               const std::vector<PolygonTriangle>& triangles) {
  double area = 0.0;
  for (const auto& [a, b, c] : triangles) {
    const auto at = [&](int corner) { return corners[static_cast<std::size_t>(corner)]; };
    const double part = area_of(at(a), at(b), at(c));
    CHECK(part > 1e-6);
    area += part;
  }
  return area;
}

double shoelace(const std::vector<MeshCorner>& corners) {
  double twice = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const MeshCorner& a = corners[i];
    const MeshCorner& b = corners[(i + 1) % corners.size()];
    twice += static_cast<double>(a[0]) * b[1] - static_cast<double>(b[0]) * a[1];
  }
  return 0.5 * twice;
}

}  // namespace

TEST_CASE("STL in its forms is read") {
  const TempFolder folder;
  const std::string text = ascii_stl(unit_cube());
  const std::string binary = binary_stl(unit_cube());
  const std::size_t half = text.find("\nfacet", text.size() / 2) + 1;
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"capitals", capitals(text)},
           {"mark", kMark + text},
           {"blank lines in front", "\n \t\n" + text},
           {"crlf", replaced(text, "\n", "\r\n")},
           {"cr", replaced(text, "\n", "\r")},
           {"tabs", replaced(text, " ", "\t")},
           {"name of several words", replaced(text, "solid body", "solid facet of a body 7")},
           {"no name", replaced(text, "solid body", "solid")},
           {"normal without numbers", replaced(text, "normal 0 0 0", "normal nan -nan(ind) 1e999")},
           {"no normal", replaced(text, "facet normal 0 0 0", "facet")},
           {"two solids",
            text.substr(0, half) + "endsolid body\nsolid other\n" + text.substr(half)},
           {"comments", replaced(text, "facet normal", "# a facet\ncolor 1 0 0\nfacet normal")},
           {"exponents", replaced(text, " 1 ", " 10.0e-1 ")},
           {"decimal commas", replaced(text, "vertex 1 ", "vertex 1,000 ")},
           {"binary", binary},
           {"binary called solid", "solid body\n" + binary.substr(11)},
           {"binary called SOLID", "SOLID BODY " + binary.substr(11)},
           {"binary with zeros in its header", std::string(80, '\0') + binary.substr(80)}}) {
    const ClosedMesh cube = read_mm(write(folder, name + ".stl", bytes));
    require_cube(cube, name);
    CHECK(cube.notes.empty());
  }
}

TEST_CASE("what stands behind the last triangle is left out, and that is said") {
  const TempFolder folder;
  const auto notes = [&](const std::string& bytes) {
    const ClosedMesh cube = read_mm(write(folder, "m.stl", bytes));
    require_cube(cube, bytes.substr(0, 20));
    return cube.notes;
  };
  const std::string binary = binary_stl(unit_cube());
  for (const std::size_t more : {1U, 49U, 50U, 1000U}) {
    const Remark said{"bytes_left_out",
                      fmt::format("{} bytes behind the last triangle were left out", more)};
    CHECK(notes(binary + std::string(more, '\0')) == std::vector{said});
    CHECK(notes("solid" + binary.substr(5) + std::string(more, 'x')) == std::vector{said});
  }
  const std::string text = ascii_stl(unit_cube());
  CHECK(notes(text + "made by hand\n") ==
        std::vector<Remark>{{"bytes_left_out", "13 bytes behind the last solid were left out"}});
  CHECK(notes(text + std::string(1, '\x1a')) ==
        std::vector<Remark>{{"bytes_left_out", "1 bytes behind the last solid were left out"}});
  CHECK(notes(text.substr(0, text.rfind("endsolid"))) ==
        std::vector<Remark>{
            {"no_endsolid", "the last solid has no 'endsolid'; the file may have been cut off"}});
}

TEST_CASE("a damaged STL is refused with its line or byte") {
  const std::string text = ascii_stl(unit_cube());
  const std::string binary = binary_stl(unit_cube());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinite = std::numeric_limits<float>::infinity();
  CHECK_THAT(stl_refusal(binary.substr(0, 300)),
             StartsWith("m.stl: byte 80: the header says 12 triangles, which end at byte 684; "
                        "the file has 300 bytes; expected "));
  CHECK_THAT(stl_refusal(with_count(binary, 0xffffffffU)),
             Contains("says 4294967295 triangles, which end at byte 214748364834"));
  CHECK_THAT(stl_refusal(with_count(binary, 0)), Contains("says that there are no triangles"));
  CHECK_THAT(stl_refusal(binary.substr(0, 83)), Contains("has 83 bytes, fewer than a header") ||
                                                    Contains("is text that does not begin"));
  // Triangle 3, corner 2, y: header, two triangles, normal, a corner.
  CHECK_THAT(stl_refusal(with_coordinate(binary, 84 + 100 + 12 + 12 + 4, nan)),
             StartsWith("m.stl: byte 208: corner 2 of triangle 3 is not finite; expected "));
  CHECK_THAT(stl_refusal(with_coordinate(binary, 84 + 12, -infinite)),
             StartsWith("m.stl: byte 96: corner 1 of triangle 1 is not finite"));
  CHECK_THAT(stl_refusal(replaced(text, "vertex 0 0 0", "vertex 0 nan 0")),
             StartsWith("m.stl:4: 'nan' is no finite number; expected three coordinates"));
  CHECK_THAT(stl_refusal(replaced(text, "vertex 0 0 0", "vertex 0 1e39 0")),
             StartsWith("m.stl:4: '1e39' is no finite number"));
  CHECK_THAT(stl_refusal("solid\nfacet\nouter loop\nvertex 0 0\nvertex 0 0 0\n"),
             StartsWith("m.stl:5: 'vertex' is no finite number"));
  CHECK_THAT(stl_refusal("solid\r\nfacet\r\nouter loop\r\nvertex 0 0"),
             StartsWith("m.stl:4: the file ends inside a vertex"));
  CHECK_THAT(stl_refusal("solid\rfacet\router loop\rvertex 0 0 0\rendloop\r"),
             StartsWith("m.stl:5: 'endloop' inside a facet; expected 'vertex'"));
  CHECK_THAT(stl_refusal(replaced(text, "endloop", "vertex 5 5 5\nendloop")),
             StartsWith("m.stl:7: a facet has a fourth vertex"));
  CHECK_THAT(stl_refusal(replaced(text, "endfacet", "end")),
             StartsWith("m.stl:8: 'end' inside a facet; expected 'endfacet'"));
  CHECK_THAT(stl_refusal("solid\nfacte normal 0 0 0\n"),
             StartsWith("m.stl:2: 'facte' where a facet should begin"));
  CHECK_THAT(stl_refusal("facet normal 0 0 1\nouter loop\n"),
             Contains("does not begin with 'solid'"));
  CHECK_THAT(stl_refusal("solid body\nendsolid body\n"), Contains("holds no triangles"));
  const TempFolder folder;
  CHECK_THAT(file_refusal(write(folder, "wide.stl", "\xFF\xFEs\0o\0l\0")), Contains("UTF-16"));
}

TEST_CASE("a mesh that is cut off anywhere is read or refused in one sentence") {
  const auto taken = [](const auto& parse, const std::string& bytes) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::string message = refusal_of([&] { (void)parse(bytes.substr(0, size), "m"); });
      INFO(size << ": " << message);
      CHECK((message.empty() || message.find("; expected ") != std::string::npos));
    }
  };
  taken(parse_stl, ascii_stl(cuboid({0, 0, 0}, {1.5, 2.25, 3})).substr(0, 1500));
  taken(parse_stl, binary_stl(unit_cube()));
  taken(parse_obj, kMark + kCorners + "usemtl a\\\nf 1/1/1 -2//3 \\\n 3/2\n" + kFaces);
}

TEST_CASE("OBJ in its forms is read") {
  const TempFolder folder;
  const std::string cube = kCorners + kFaces;
  const std::string attributes = "vt 0 0\nvt 1 0 0\nvn 0 0 1\n";
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"plain", cube},
           {"mark", kMark + cube},
           {"crlf", replaced(cube, "\n", "\r\n")},
           {"cr", replaced(cube, "\n", "\r")},
           {"no last line end", cube.substr(0, cube.size() - 1)},
           {"tabs and blanks", replaced(replaced(cube, " ", " \t "), "\n", " \t\n")},
           {"indented", "  " + replaced(cube, "\n", "\n  ")},
           {"textures",
            kCorners + attributes + cube_faces([](int v) { return fmt::format("{}/2", v); })},
           {"normals",
            kCorners + attributes + cube_faces([](int v) { return fmt::format("{}//1", v); })},
           {"both",
            kCorners + attributes + cube_faces([](int v) { return fmt::format("{}/-1/1", v); })},
           {"negative", kCorners + cube_faces([](int v) { return fmt::format("{}", v - 9); })},
           {"mixed",
            kCorners + cube_faces([](int v) { return fmt::format("{}", v % 2 ? v : v - 9); })},
           {"faces before vertices", kFaces + kCorners},
           {"continued", replaced(cube, " 4", " \\\n 4")},
           {"continued with crlf", replaced(replaced(cube, " 4", " \\\n 4"), "\n", "\r\n")},
           {"comments", "# v 7 7 7\\\n" + replaced(cube, "\n", " # f 1 2 3\n")},
           {"weights",
            "v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 2\nv 2 2 0 2\nv 0 0 2 2\nv 2 0 2 2\n"
            "v 0 2 2 2\nv 2 2 2 2\n" +
                kFaces},
           {"colours", replaced(kCorners, "\n", " 0.5 0.25 1\n") + kFaces},
           {"loose ends", cube + "p 1 2\nl 1 2 3\n"},
           {"objects and materials",
            "mtllib /dev/zero\no a\ng b c\ns 1\n" + replaced(cube, "f ", "usemtl C:\\\nf ")},
           {"unused vertices", "v 90 90 90\n" + kCorners +
                                   cube_faces([](int v) { return fmt::format("{}", v - 9); })}}) {
    const ClosedMesh mesh = read_mm(write(folder, "m.obj", text));
    require_cube(mesh, name);
    CHECK(mesh.notes.empty());
  }
  const ClosedMesh noted = read_mm(write(folder, "m.obj", cube + "f 1 2\nf 3\n"));
  require_cube(noted, "faces of two corners");
  CHECK(noted.notes == std::vector<Remark>{{"faces_left_out",
                                            "2 faces of fewer than three corners were left out"}});
}

TEST_CASE("a damaged OBJ is refused with its line") {
  CHECK_THAT(obj_refusal(kCorners + "f 1 2 9\n"),
             StartsWith("m.obj:9: a face names vertex 9 of 8; expected "));
  CHECK_THAT(obj_refusal("v 0 0 0\nv 1 0 0\nf 1 2 -3\n"),
             StartsWith("m.obj:3: a face names vertex -3 of 2"));
  CHECK_THAT(obj_refusal(kCorners + "f 1 2 2147483647\n"),
             StartsWith("m.obj:9: a face names vertex"));
  for (const char* corner : {"0", "x", "1/a", "1/1/1/1", "1.5", "99999999999", "1/2/3x", "/1"}) {
    CHECK_THAT(obj_refusal(kCorners + "f 1 2 " + corner + "\n"),
               StartsWith(fmt::format("m.obj:9: '{}' names no corner; expected ", corner)));
  }
  CHECK_THAT(obj_refusal("v 0 0 0\r\nv 0 nan 0\r\n"),
             StartsWith("m.obj:2: 'nan' is no finite number; expected v and three coordinates"));
  CHECK_THAT(obj_refusal("v 0 0 0\rv 0 inf 0\r"), StartsWith("m.obj:2: 'inf' is no finite number"));
  CHECK_THAT(obj_refusal("v 1 2 1.5abc\n"), StartsWith("m.obj:1: '1.5abc' is no finite number"));
  CHECK_THAT(obj_refusal("v 1 2 1.#QNAN\n"), StartsWith("m.obj:1: "));
  CHECK_THAT(obj_refusal("v 1 2\n"), StartsWith("m.obj:1: a vertex of 2 numbers"));
  CHECK_THAT(obj_refusal("v 1 2 3 4 5\n"), StartsWith("m.obj:1: a vertex of 5 numbers"));
  CHECK_THAT(obj_refusal("v 1 2 3 0\n"), StartsWith("m.obj:1: a weight of 0"));
  CHECK_THAT(obj_refusal("usemtl a\n"), StartsWith("m.obj: holds no faces"));
  CHECK_THAT(obj_refusal("v 3 1 0\nv 2 4 0\nv 4 4 0\nv 4 3 0\nv 0 3 0\nf 1 2 3 4 5\n"),
             StartsWith("m.obj:6: a face cannot be cut into triangles: its sides cross"));
}

TEST_CASE("names of materials and groups cost nothing") {
  std::string text = kCorners;
  for (int i = 0; i < 50000; ++i) text += fmt::format("usemtl material_{}\ng group_{}\n", i, i);
  const MeshContents contents = parse_obj(text + kFaces, "m.obj");
  CHECK(contents.mesh.vertices.cols() == 8);
  CHECK(contents.mesh.triangles.cols() == 12);
}

TEST_CASE("vertices are numbered as faces come to them, in the order of the file") {
  const MeshContents contents =
      parse_obj("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 5 3 2\nf 2 4 5\n", "m.obj");
  Positions expected(3, 4);
  expected.col(0) = Vector3d(0, 0, 1);
  expected.col(1) = Vector3d(1, 0, 0);
  expected.col(2) = Vector3d(0, 0, 0);
  expected.col(3) = Vector3d(0, 1, 0);
  CHECK(contents.mesh.vertices == expected);
  CHECK(contents.mesh.triangles.col(0) == Eigen::Vector3i(0, 1, 2));
  CHECK(contents.mesh.triangles.col(1) == Eigen::Vector3i(2, 3, 0));
}

TEST_CASE("coordinates are the sum of whole part and decimals in single precision") {
  CHECK(find_mesh_coordinate("-12.5") == -12.5F);
  CHECK(find_mesh_coordinate("+.25") == 0.25F);
  CHECK(find_mesh_coordinate("7.") == 7.0F);
  CHECK(find_mesh_coordinate("1,5") == 1.5F);
  CHECK(find_mesh_coordinate("2E3") == 2000.0F);
  CHECK(find_mesh_coordinate("16777217") == 16777216.0F);
  CHECK(find_mesh_coordinate("28.977775") == 28.0F + 0.977775F);
  CHECK(find_mesh_coordinate("0.12345678901234567890123") == 0.123456789012345F);
  CHECK(std::signbit(*find_mesh_coordinate("-0.0")));
  for (const char* text : {"", "-", ".", "e5", "1e", "1e+", "--1", "1.2.3", "1,000.5", "0x10",
                           "nan", "inf", "1e39", "1 ", "1e9999999999", "1234567890123456789"}) {
    INFO(text);
    CHECK(!find_mesh_coordinate(text));
  }
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const double value = 1000.0 * random.normal();
    const auto nearest = static_cast<float>(value);
    const auto read = find_mesh_coordinate(fmt::format("{:.9f}", value));
    REQUIRE(read);
    CHECK_THAT(*read, WithinAbs(nearest, 1.2e-7 * std::abs(nearest) + 1e-9));
  }
}

TEST_CASE("polygons are cut into triangles that cover them") {
  for (const int n : {3, 4, 5, 6, 9, 40, 1000}) {
    std::vector<MeshCorner> round;
    for (int i = 0; i < n; ++i) {
      const double angle = 2.0 * M_PI * i / n;
      round.push_back(
          {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0});
    }
    const auto triangles = cut_polygon(round);
    CHECK(triangles.size() == round.size() - 2);
    if (n <= 40) CHECK_THAT(area_of(round, triangles), WithinRel(shoelace(round), 1e-5));
  }
  const std::vector<std::vector<MeshCorner>> shapes{
      {{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}},                        // an arrow
      {{0, 0, 0}, {4, 0, 0}, {4, 1, 0}, {1, 1, 0}, {1, 4, 0}, {0, 4, 0}},  // L
      {{0, 0, 0}, {2, 0, 0}, {4, 0, 0}, {0, 4, 0}},                        // a corner on a side
      {{2, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 0}},
      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 2, 0}},
      {{0, 0, 0},
       {4, 0, 0},
       {4, 4, 0},
       {3, 4, 0},
       {3, 1, 0},
       {1, 1, 0},
       {1, 4, 0},
       {0, 4, 0}},  // U
      {{0, 0, 0}, {3, 1, 0}, {6, 0, 0}, {5, 3, 0}, {6, 6, 0}, {3, 5, 0}, {0, 6, 0}, {1, 3, 0}}};
  for (const auto& shape : shapes) {
    for (std::size_t first = 0; first < shape.size(); ++first) {
      std::vector<MeshCorner> turned(shape.begin() + static_cast<std::ptrdiff_t>(first),
                                     shape.end());
      turned.insert(turned.end(), shape.begin(),
                    shape.begin() + static_cast<std::ptrdiff_t>(first));
      CAPTURE(shape.size(), first);
      CHECK_THAT(area_of(turned, cut_polygon(turned)), WithinRel(shoelace(shape), 1e-9));
    }
  }
  CHECK(cut_polygon(std::vector<MeshCorner>{{3, 1, 0}, {2, 4, 0}, {4, 4, 0}, {4, 3, 0}, {0, 3, 0}})
            .empty());
}

TEST_CASE("a body whose faces have corners on their sides is read") {
  const TempFolder folder;
  // A cube whose edge from (0, 0, 0) to (1, 0, 0) has a corner in its middle.
  const std::string text = kCorners + "v 0.5 0 0\n" +
                           "f 1 3 4 2 9\nf 5 6 8 7\nf 1 9 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  const ClosedMesh cube = read_mm(write(folder, "m.obj", text));
  CHECK(cube.mesh.vertices.cols() == 9);
  CHECK(cube.mesh.triangles.cols() == 14);
  CHECK_THAT(mesh_volume(cube.mesh), WithinRel(1e-9, 1e-12));
}
