// Closed surfaces from meshes: distances in closed form, files, and what is refused.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "mesh_bytes.hpp"
#include "organ_meshes.hpp"
#include "refusal.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/mesh_file.hpp"
#include "tpm/organ/body/mesh_surface.hpp"
#include "tpm/organ/body/triangle_tree.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using Eigen::Vector3d;

namespace {

std::string mesh_refusal(const TriangleMesh& mesh) {
  return refusal_of([&] { (void)closed_mesh(mesh, "m.stl"); });
}

TriangleMesh without_triangle(const TriangleMesh& mesh, Eigen::Index dropped) {
  TriangleMesh result = mesh;
  result.triangles.col(dropped) = mesh.triangles.col(mesh.triangles.cols() - 1);
  result.triangles.conservativeResize(3, mesh.triangles.cols() - 1);
  return result;
}

const std::string kCubeObj =
    "# a cube of quads\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
    "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

}  // namespace

TEST_CASE("distances to a cube are those of the closed form") {
  const MeshSurface cube(closed_mesh(unit_cube(), "cube").mesh);
  CHECK_THAT(cube.area(), WithinRel(6.0, 1e-14));
  CHECK_THAT(cube.volume(), WithinRel(1.0, 1e-14));
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p = Vector3d(random.uniform(), random.uniform(), random.uniform()) * 3.0 -
                       Vector3d::Constant(1.0);
    const Vector3d beyond = (p - Vector3d::Constant(0.5)).cwiseAbs() - Vector3d::Constant(0.5);
    const double expected =
        beyond.maxCoeff() < 0.0 ? beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
    CHECK_THAT(cube.signed_distance(p), WithinAbs(expected, 1e-13));
  }
}

TEST_CASE("normals of a cube are those of its faces, and on a crease their mean") {
  const MeshSurface cube(closed_mesh(unit_cube(), "cube").mesh);
  CHECK((cube.nearest({0.3, 0.2, 1.4}).normal - Vector3d::UnitZ()).norm() < 1e-14);
  CHECK((cube.nearest({0.5, 0.5, 0.9}).normal - Vector3d::UnitZ()).norm() < 1e-14);
  CHECK((cube.nearest({0.4, 1.5, 1.5}).normal - Vector3d(0, 1, 1).normalized()).norm() < 1e-14);
  CHECK((cube.nearest({2, 2, 2}).normal - Vector3d(1, 1, 1).normalized()).norm() < 1e-14);
}

TEST_CASE("a meshed sphere has the sphere's area, volume, distance and normals") {
  const MeshSurface ball(closed_mesh(round_cube(40), "ball").mesh);
  const Sphere exact(1.0);
  CHECK_THAT(ball.area(), WithinRel(exact.area(), 2e-3));
  CHECK_THAT(ball.volume(), WithinRel(exact.volume(), 2e-3));
  Random random(7);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d p(random.normal(), random.normal(), random.normal());
    CHECK_THAT(ball.signed_distance(p), WithinAbs(exact.signed_distance(p), 1e-3));
    if (p.norm() > 0.5) {
      CHECK((ball.nearest(p).normal - exact.nearest(p).normal).norm() < 0.03);
    }
  }
}

TEST_CASE("the nearest point is that of the nearest triangle, in a tree of any shape") {
  for (const TriangleMesh& mesh : {unit_cube(), round_cube(3), round_cube(4), round_cube(40)}) {
    const MeshSurface surface(closed_mesh(mesh, "mesh").mesh);
    Random random(11);
    Vector3d walker(1.0, 0.0, 0.0);
    const int questions = mesh.triangles.cols() < 1000 ? 20 : 3;
    for (int i = 0; i < questions; ++i) {
      for (double& x : walker) x += 0.1 * random.normal();
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
        TriangleMesh alone;
        alone.vertices.resize(3, 3);
        for (Eigen::Index which = 0; which < 3; ++which) {
          alone.vertices.col(which) = mesh.corner(t, which);
        }
        alone.triangles = Eigen::Vector3i(0, 1, 2);
        least = std::min(least, TriangleTree(alone).nearest(walker).squared_distance);
      }
      const Vector3d found = surface.nearest_position(walker, 10.0);
      CHECK_THAT((found - walker).norm(), WithinAbs(std::sqrt(least), 1e-12));
      CHECK((found - surface.nearest(walker).position).norm() < 1e-12);
    }
  }
}

TEST_CASE("the place of a point that moves is that of a new question, to the last bit") {
  for (const TriangleMesh& mesh : {unit_cube(), round_cube(3), round_cube(40)}) {
    const MeshSurface surface(closed_mesh(mesh, "mesh").mesh);
    Random random(5);
    Vector3d walker = surface.mesh().corner(0, 0);
    NearParts near;
    for (int i = 0; i < 300; ++i) {
      // On the surface, close to it, and far inside, now and then in one leap.
      const double step = i % 50 == 0 ? 1.0 : i % 3 == 0 ? 0.0 : 1e-3;
      for (double& x : walker) x += step * random.normal();
      const Vector3d expected = surface.nearest_position(walker, 10.0);
      CHECK(surface.nearest_of_moved(walker, 10.0, near) == expected);
      CHECK((near.part >= 0 && near.part < mesh.triangles.cols()));
      if (i % 3 == 1) walker = expected;
    }
    NearParts beyond;
    beyond.part = static_cast<int>(mesh.triangles.cols());
    CHECK(surface.nearest_of_moved(walker, 10.0, beyond) == surface.nearest_position(walker, 10.0));
  }
}

TEST_CASE(
    "a point that creeps over a mesh is placed among the triangles near it, to the last bit") {
  for (const TriangleMesh& mesh : {unit_cube(), round_cube(3), round_cube(40)}) {
    const MeshSurface surface(closed_mesh(mesh, "mesh").mesh);
    Random random(7);
    Vector3d walker =
        (surface.mesh().corner(0, 0) + surface.mesh().corner(0, 1) + surface.mesh().corner(0, 2)) /
        3.0;
    NearParts near;
    int lists = 0;
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; ++i) {
      const Vector3d listed = near.place;
      for (double& x : walker) x += 1e-4 * random.normal();
      const Vector3d expected = surface.nearest_position(walker, 1.0);
      CHECK(surface.nearest_of_moved(walker, 1.0, near) == expected);
      if (near.place != listed) ++lists;
      walker = expected;
    }
    CHECK(lists < kSteps / 2);
  }
}

TEST_CASE("points are spread in proportion to area") {
  const MeshSurface cube(closed_mesh(unit_cube(), "cube").mesh);
  const Positions points = cube.spread(6000, 1);
  CHECK(std::abs((points.row(2).array() > 1.0 - 1e-12).count() - 1000) <= 2);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    CHECK(std::abs(cube.signed_distance(points.col(i))) < 1e-14);
  }
  CHECK(points == cube.spread(6000, 1));
  CHECK(points != cube.spread(6000, 2));
}

TEST_CASE("faults of a mesh are refused with their place") {
  CHECK_THAT(
      mesh_refusal(without_triangle(unit_cube(), 4)),
      Contains("m.stl: the surface is open: the edge from (") && Contains("belongs only to"));
  TriangleMesh twisted = unit_cube();
  std::swap(twisted.triangles(0, 3), twisted.triangles(1, 3));
  CHECK_THAT(mesh_refusal(twisted), Contains("wind differently") && Contains("triangle 4"));
  CHECK_THAT(mesh_refusal(self_cutting_tube()), Contains("the surface cuts itself: triangle"));
  const TriangleMesh apart = both(unit_cube(), cuboid({2, 0, 0}, {3, 1, 1}));
  CHECK_THAT(mesh_refusal(apart), Contains("triangle 13 at (") && Contains("is not connected"));
  const TriangleMesh by_edge = both(unit_cube(), cuboid({1, 1, 0}, {2, 2, 1}));
  CHECK_THAT(mesh_refusal(by_edge), Contains("belongs to 4 triangles"));
  TriangleMesh flat = cuboid({0, 0, 0}, {1, 1, 1e-12});
  CHECK_THAT(mesh_refusal(flat), Contains("m.stl: "));
  TriangleMesh bad = unit_cube();
  bad.vertices(0, 2) = std::nan("");
  CHECK_THAT(mesh_refusal(bad), Contains("vertex 3 is not finite"));
  CHECK_THAT(mesh_refusal(TriangleMesh{}), Contains("holds no triangles"));
}

TEST_CASE("two crossing cubes cut each other") {
  const TriangleMesh crossing = both(unit_cube(), cuboid({0.5, 0.4, 0.3}, {1.5, 1.4, 1.3}));
  CHECK(first_crossing(crossing)[0] >= 0);
  const TriangleMesh inside = both(unit_cube(), cuboid({0.2, 0.2, 0.2}, {0.8, 0.8, 0.8}));
  CHECK(first_crossing(inside)[0] == -1);
  const TriangleMesh flush = both(unit_cube(), cuboid({1.0, 0.2, 0.2}, {2.0, 0.8, 0.8}));
  CHECK(first_crossing(flush)[0] >= 0);
  CHECK(first_crossing(round_cube(10))[0] >= 0);  // copies of the seams, not welded
  CHECK(first_crossing(closed_mesh(round_cube(10), "ball").mesh)[0] == -1);
}

TEST_CASE("a mesh that faces inwards is turned, and that is said") {
  TriangleMesh inverted = unit_cube();
  inverted.triangles.row(0).swap(inverted.triangles.row(1));
  const ClosedMesh result = closed_mesh(inverted, "m.stl");
  CHECK(result.notes ==
        std::vector<Remark>{{"triangles_turned", "the triangles faced inwards and were turned"}});
  CHECK_THAT(mesh_volume(result.mesh), WithinRel(1.0, 1e-14));
  CHECK(closed_mesh(unit_cube(), "m.stl").notes.empty());
}

TEST_CASE("text STL, binary STL and OBJ with quads give the same body") {
  const TempFolder folder;
  const Unit mm = parse_unit("mm", Dimension::length, "test");
  for (const std::string& path : {write(folder, "text.stl", ascii_stl(unit_cube())),
                                  write(folder, "binary.STL", binary_stl(unit_cube())),
                                  write(folder, "quads.obj", kCubeObj)}) {
    const ClosedMesh cube = read_closed_mesh(path, mm);
    INFO(path);
    CHECK(cube.mesh.vertices.cols() == 8);
    CHECK(cube.mesh.triangles.cols() == 12);
    CHECK_THAT(mesh_volume(cube.mesh), WithinRel(1e-9, 1e-6));
    CHECK(cube.notes.empty());
  }
}

TEST_CASE("files that hold no closed surface are refused in one line") {
  const TempFolder folder;
  CHECK_THAT(file_refusal(folder / "none.stl"), Contains("no such file"));
  CHECK_THAT(file_refusal(write(folder, "empty.stl", "")), Contains("the file is empty"));
  CHECK_THAT(file_refusal(write(folder, "body.ply", "ply")), Contains("'.ply' is no known format"));
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"words.stl", "hello there, this is no mesh"},
           {"short.stl", binary_stl(unit_cube()).substr(0, 300)},
           {"words.obj", "hello there"},
           {"index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"},
           {"open.stl", ascii_stl(without_triangle(unit_cube(), 0))}}) {
    const std::string message = file_refusal(write(folder, name, bytes));
    INFO(name << ": " << message);
    CHECK_THAT(message, Contains(name));
    CHECK_THAT(message, Contains("; expected "));
    CHECK(message.find('\n') == std::string::npos);
  }
}

TEST_CASE("a mesh of a user is filled like any other surface") {
  const MeshSurface cube(closed_mesh(cuboid({0, 0, 0}, {0.1, 0.1, 0.1}), "cube").mesh);
  ShellRequest request;
  request.count = 601;
  const Organ organ = fill_shell(cube, request);
  CHECK(organ.size() == 601);
  for (const NearestDistances& layer : nearest_distances(organ)) CHECK(layer.min > 0.6);
}
