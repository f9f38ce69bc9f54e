// Fillings of surfaces with spheres, the liver of the paper, and the search for neighbours.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "expected_values.hpp"
#include "organ_meshes.hpp"
#include "refusal.hpp"
#include "solid_fillings.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/landing_site.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/body/mesh_surface.hpp"
#include "tpm/organ/body/neighbours.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using Eigen::Vector3d;

namespace {

ShellRequest shell_of(std::size_t count, int layers) {
  ShellRequest request;
  request.count = count;
  request.layers = layers;
  return request;
}

bool same(const Organ& a, const Organ& b) {
  return a.position == b.position && a.normal == b.normal && a.layer == b.layer &&
         a.spacing == b.spacing && a.contact == b.contact;
}

std::string organ_refusal(const Organ& organ) {
  return refusal_of([&] { require_valid(organ, "organ"); });
}

/// The largest angle between the normals of two triangles with a common edge, rad.
double sharpest_edge(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, Vector3d> open;
  double sharpest = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Vector3d normal = mesh.area_vector(t).normalized();
    for (Eigen::Index i = 0; i < 3; ++i) {
      const std::pair<int, int> edge =
          std::minmax({mesh.triangles(i, t), mesh.triangles((i + 1) % 3, t)});
      const auto [found, fresh] = open.try_emplace(edge, normal);
      if (fresh) continue;
      sharpest = std::max(
          sharpest, std::atan2(normal.cross(found->second).norm(), normal.dot(found->second)));
    }
  }
  return sharpest;
}

}  // namespace

TEST_CASE("pairs within a radius are those that brute force finds, in order") {
  Random random(3);
  Positions points(3, 400);
  for (double& x : points.reshaped()) x = random.uniform();
  for (const double radius : {0.01, 0.1, 0.3}) {
    std::vector<NeighbourPair> expected;
    for (std::size_t i = 0; i < 400; ++i) {
      for (std::size_t j = i + 1; j < 400; ++j) {
        const auto a = static_cast<Eigen::Index>(i);
        const auto b = static_cast<Eigen::Index>(j);
        if ((points.col(a) - points.col(b)).squaredNorm() <= radius * radius) {
          expected.push_back({i, j});
        }
      }
    }
    CHECK(pairs_within(points, radius) == expected);
  }
  CHECK(pairs_within(points.leftCols(1), 1.0).empty());
  CHECK_THROWS_WITH(pairs_within(points, -1.0), Contains("support radius: -1 m"));
}

TEST_CASE("pairs are found however far apart the groups of points lie") {
  // More radii apart than a grid of cubes of that size can number.
  Positions points = Positions::Zero(3, 6);
  points.row(0) << 1.0, 0.0, 5e7, 5e7 + 1.0, 0.0, -5e7;
  points.row(2) << 0.0, 0.5, 0.0, 0.0, 9e7, 0.0;
  CHECK(pairs_within(points, 1.25) == std::vector<NeighbourPair>{{0, 1}, {2, 3}});
  CHECK(pairs_within(points, 1.0) == std::vector<NeighbourPair>{{2, 3}});
}

TEST_CASE("a point exactly on the support radius is a neighbour") {
  Positions points = Positions::Zero(3, 3);
  points(0, 1) = 0.02;
  points(0, 2) = 0.05;
  CHECK(pairs_within(points, 0.02) == std::vector<NeighbourPair>{{0, 1}});
}

TEST_CASE("the liver of the paper has what the paper prints", "[heavy]") {
  const Organ liver = paper_liver();
  CHECK(liver.size() == 424);
  CHECK(liver.layer_count() == 2);
  CHECK(std::count(liver.layer.begin(), liver.layer.end(), 0) == 212);
  CHECK(liver.radius == 0.010);
  CHECK(liver.spacing == 0.020);
  REQUIRE(liver.contact == 70U);
  CHECK(liver.position.col(70) == Vector3d(0.002, 0.136, 0.057));
  CHECK(liver.normal.col(70) == -Vector3d::UnitZ());
  CHECK_NOTHROW(require_valid(liver, "liver"));
  CHECK(least_distance(liver) > 0.6);
  // The partner of sphere 71 lies one spacing further along +z.
  CHECK((liver.position.col(70 + 212) - Vector3d(0.002, 0.136, 0.077)).norm() < 2e-9);
  CHECK(same(liver, paper_liver()));
}

TEST_CASE("the liver of the paper is flat where the probe lands") {
  const Organ liver = paper_liver();
  int beside = 0;
  for (Eigen::Index i = 0; i < 212; ++i) {
    const Vector3d from = liver.position.col(i) - liver.position.col(70);
    if (i == 70 || from.norm() > kLandingReach * liver.spacing) continue;
    CHECK(std::abs(from.z()) < 1.1e-9);  // coordinates are whole nanometres
    ++beside;
  }
  CHECK(beside == 6);
  // The edge of a cube is no landing site.
  ShellRequest request = shell_of(200, 2);
  request.landing = Vector3d(1.0, 1.0, 0.5);
  const Organ edge = fill_shell(MeshSurface(unit_cube()), request);
  REQUIRE(edge.contact);
  CHECK((edge.position.col(static_cast<Eigen::Index>(*edge.contact)) - *request.landing).norm() <
        edge.spacing);
  CHECK(edge.assumptions.at(1).code == "curved_at_contact");
  CHECK(liver.assumptions.at(4).code == "flat_at_contact");
  CHECK_THAT(liver.assumptions.at(4).text, Contains("flat within 1.5 spacings"));
}

TEST_CASE("the numbering of the liver of the paper stays as it is") {
  const Organ liver = paper_liver();
  const auto number = [&](Eigen::Index n) { return Vector3d(liver.position.col(n - 1)); };
  const auto stays = [&](Eigen::Index n, const Expected& place) {
    return (number(n) - Eigen::Map<const Vector3d>(place.numbers().data())).norm() <
           place.tolerance();
  };
  INFO(number(1).transpose() << "; " << number(212).transpose() << "; " << number(424).transpose());
  CHECK(stays(1, expected("paper_liver.sphere_1")));
  CHECK(stays(212, expected("paper_liver.sphere_212")));
  CHECK(stays(424, expected("paper_liver.sphere_424")));
}

TEST_CASE("the liver is of a real one's size and answers its measures") {
  const LiverShape shape;
  const MeshSurface surface = liver_surface(shape);
  CHECK_THAT(surface.bounds().sizes().x(), WithinRel(shape.width, 0.02));
  CHECK_THAT(surface.bounds().sizes().y(), WithinRel(shape.height, 0.12));
  CHECK_THAT(surface.bounds().sizes().z(), WithinRel(shape.depth, 0.06));
  CHECK_NOTHROW(closed_mesh(surface.mesh(), "liver"));
  const double factor = 0.020 / even_spacing(surface, 212);
  const MeshSurface filled = liver_surface(scaled(shape, factor));
  CHECK_THAT(filled.area(), WithinRel(212 * 4e-4 * std::sqrt(0.75), 1e-9));
  CHECK(filled.volume() > 1.2e-3);
  CHECK(filled.volume() < 1.8e-3);
  LiverShape wrong = shape;
  wrong.notch_depth = 0.5;
  CHECK_THROWS_WITH(liver_surface(wrong),
                    Contains("notch_depth of the liver is 0.5; expected 0.1 to 0.2"));
}

TEST_CASE("every end of the liver's ranges gives a closed smooth surface", "[heavy]") {
  for (const LiverMeasure& measure : liver_measures()) {
    if (measure.name == "width") continue;
    for (const double share : {measure.least, measure.most}) {
      LiverShape shape;
      shape.*measure.value = share * (measure.unit == nullptr ? 1.0 : shape.*measure.unit);
      const MeshSurface surface = liver_surface(shape);
      INFO(measure.name << " = " << shape.*measure.value);
      CHECK_NOTHROW(closed_mesh(surface.mesh(), "liver"));
      CHECK(sharpest_edge(surface.mesh()) < 0.95);  // rad; an overhang would show as a cliff
      CHECK(surface.volume() > 0.1 * shape.width * shape.height * shape.depth);
    }
  }
}

TEST_CASE("a liver has the number of spheres and layers asked for, exactly", "[heavy]") {
  const std::size_t count = GENERATE(60U, 424U, 4001U);
  const int layers = GENERATE(1, 2, 3);
  if (count < static_cast<std::size_t>(layers)) return;
  LiverRequest request;
  request.count = count;
  request.layers = layers;
  const Organ liver = fill_liver(request);
  CHECK(liver.size() == count);
  CHECK(liver.layer_count() == layers);
  const auto in_first = std::count(liver.layer.begin(), liver.layer.end(), 0);
  const auto parts = static_cast<std::size_t>(layers);
  CHECK(in_first == static_cast<std::ptrdiff_t>((count + parts - 1) / parts));
  CHECK(liver.position.col(static_cast<Eigen::Index>(*liver.contact)) ==
        Vector3d(0.002, 0.136, 0.057));
  if (count >= 4001U) CHECK(least_distance(liver) > 0.6);
}

TEST_CASE("on a sphere the spheres are even and the columns stand straight") {
  const Sphere surface(0.1);
  const Organ organ = fill_shell(surface, shell_of(4000, 2));
  CHECK_THAT(organ.spacing, WithinRel(even_spacing(surface, 2000), 1e-12));
  const NearestDistances outer = nearest_distances(organ)[0];
  CHECK(outer.min > 0.75);
  CHECK(outer.mean > 0.9);
  for (Eigen::Index i = 0; i < 2000; ++i) {
    CHECK(std::abs(organ.position.col(i).norm() - 0.1) < 2e-9);
    CHECK(
        (organ.position.col(i) - organ.spacing * organ.normal.col(i) - organ.position.col(i + 2000))
            .norm() < 3e-9);
  }
}

TEST_CASE("count and spacing of a shell decide each other and must agree") {
  const Sphere surface(0.1);
  ShellRequest request;
  request.spacing = 0.02;
  const Organ organ = fill_shell(surface, request);
  CHECK(organ.size() == 2 * even_count(surface, 0.02));
  CHECK(organ.radius == 0.01);
  request.count = organ.size();
  CHECK(fill_shell(surface, request).size() == organ.size());
  request.spacing = 0.03;
  CHECK_THROWS_WITH(fill_shell(surface, request), Contains("do not fit a surface of 0.125664 m^2"));
  CHECK_THROWS_WITH(fill_shell(surface, {}), Contains("neither a number of spheres nor a spacing"));
  CHECK_THROWS_WITH(fill_shell(surface, shell_of(1, 1)), Contains("expected 2 to 1000000"));
  CHECK_THROWS_WITH(fill_shell(surface, shell_of(2, 3)), Contains("3 layers of 2 spheres"));
  CHECK_THROWS_WITH(fill_shell(surface, shell_of(20, 0)), Contains("layers: 0"));
  request = {};
  request.spacing = std::nan("");
  CHECK_THROWS_WITH(fill_shell(surface, request), Contains("spacing: nan m"));
}

TEST_CASE("a moved mesh moves its filling") {
  const TriangleMesh mesh = closed_mesh(round_cube(12), "sphere").mesh;
  const Organ organ = fill_shell(MeshSurface(mesh), shell_of(60, 2));
  TriangleMesh shifted = mesh;
  const Vector3d shift(0.3, -0.2, 0.7);
  shifted.vertices.colwise() += shift;
  const Organ there = fill_shell(MeshSurface(shifted), shell_of(60, 2));
  CHECK(((there.position.colwise() - shift) - organ.position).colwise().norm().maxCoeff() < 1e-6);

  TriangleMesh turned = mesh;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  turned.vertices = turn * mesh.vertices;
  const Organ other = fill_shell(MeshSurface(turned), shell_of(60, 2));
  for (Eigen::Index i = 0; i < 60; ++i) {  // numbers go by x and so change, places do not
    const Vector3d expected = turn * organ.position.col(i);
    CHECK((other.position.colwise() - expected).colwise().norm().minCoeff() < 1e-6);
  }
}

TEST_CASE("a solid filling has the count or the spacing asked for") {
  const Sphere surface(0.1);
  for (const Lattice lattice : {Lattice::cubic, Lattice::bcc, Lattice::fcc}) {
    for (const std::size_t count : {60U, 424U, 5000U}) {
      SolidRequest request;
      request.count = count;
      request.lattice = lattice;
      const Organ organ = fill_solid(surface, request);
      INFO(count << " " << entry_of(kLatticeWords, lattice).text);
      CHECK(organ.size() == count);
      CHECK((organ.position.colwise().norm().array() < 0.1 + 1e-8).all());
      if (count > 400) CHECK(least_distance(organ) > 0.6);
    }
  }
  SolidRequest request;
  request.spacing = 0.01;
  const Organ organ = fill_solid(surface, request);
  CHECK(organ.spacing == 0.01);
  CHECK(organ.layer_count() == 11);
  CHECK(same(organ, fill_solid(surface, request)));
  CHECK_THROWS_WITH(fill_solid(surface, {}), Contains("neither"));
  request.count = 4;
  CHECK_THROWS_WITH(fill_solid(surface, request), Contains("both"));
  request = {};
  request.spacing = 1e-5;
  CHECK_THROWS_WITH(fill_solid(surface, request), Contains("expected at most 1000000 spheres"));
}

TEST_CASE("the layers of a solid filling lie ever deeper") {
  const Sphere surface(0.1);
  SolidRequest request;
  request.spacing = 0.015;
  const Organ organ = fill_solid(surface, request);
  CHECK(std::is_sorted(organ.layer.begin(), organ.layer.end()));
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const double depth = 0.1 - organ.position.col(column).norm();
    if (organ.layer[i] == 0) {
      CHECK(std::abs(depth) < 2e-9);
    } else {
      // Those of the first layer that were added below outer spheres may lie less deep.
      CHECK(depth > (organ.layer[i] - (organ.layer[i] == 1 ? 0.5 : 0.3)) * 0.015 - 2e-9);
      CHECK(depth < (organ.layer[i] + 0.7) * 0.015 + 2e-9);
    }
    if (depth < 0.099) CHECK(organ.normal.col(column).dot(organ.position.col(column)) > 0.0);
  }
}

TEST_CASE("a block is a lattice with all points on its faces") {
  const Organ cubic = block(3, 2, 1, 0.02, Lattice::cubic);
  CHECK(cubic.size() == 24);
  CHECK(cubic.layer_count() == 2);
  CHECK(cubic.position.col(0) == Vector3d(0, 0, 0.02));
  CHECK(cubic.normal.col(5) == Vector3d::UnitZ());
  const Organ bcc = block(2, 2, 2, 0.02, Lattice::bcc);
  CHECK(bcc.size() == 27 + 8);
  const Organ fcc = block(2, 2, 2, 0.02, Lattice::fcc);
  CHECK(fcc.size() == 27 + 3 * 12);
  CHECK(fcc.layer_count() == 5);
  for (const Organ& organ : {cubic, bcc, fcc}) {
    CHECK_NOTHROW(require_valid(organ, "block"));
    CHECK_THAT(least_distance(organ), WithinRel(1.0, 1e-12));
  }
  CHECK_THROWS_WITH(block(0, 1, 1, 0.02, Lattice::bcc), Contains("0 cells along x"));
  CHECK_THROWS_WITH(block(1000, 1000, 1000, 0.02, Lattice::bcc), Contains("2 to 1000000"));
  CHECK_THROWS_WITH(block(1, 1, 1, 0.0, Lattice::bcc), Contains("spacing of the block: 0 m"));
}

TEST_CASE("the star has A and C beside B and D below it") {
  const Organ organ = star(0.03, 0.02);
  CHECK_NOTHROW(require_valid(organ, "star"));
  CHECK(organ.contact == 1U);
  CHECK(organ.position.col(1) == Vector3d::Zero());
  CHECK(organ.position.col(0) == Vector3d(-0.03, 0, 0));
  CHECK(organ.position.col(2) == Vector3d(0.03, 0, 0));
  CHECK(organ.position.col(3) == Vector3d(0, 0, -0.02));
  CHECK(organ.layer == std::vector<int>{0, 0, 0, 1});
  CHECK_THROWS_WITH(star(-1, 1), Contains("spacing of the star: -1 m"));
}

TEST_CASE("an organ that is not one is refused with the first fault") {
  const Organ good = star(0.03, 0.02);
  Organ organ = good;
  organ.position(1, 2) = std::nan("");
  CHECK_THAT(organ_refusal(organ), Contains("sphere 3 has a coordinate that is not finite"));
  organ = good;
  organ.normal(2, 0) = 0.5;
  CHECK_THAT(organ_refusal(organ), Contains("the normal of sphere 1 has length 0.5"));
  organ = good;
  organ.position.col(3) = organ.position.col(0);
  CHECK_THAT(organ_refusal(organ), Contains("sphere 1 lies where another sphere lies"));
  organ = good;
  organ.layer = {0, 0, 0, 2};
  CHECK_THAT(organ_refusal(organ), Contains("layer 1 has no spheres"));
  organ = good;
  organ.layer.pop_back();
  CHECK_THAT(organ_refusal(organ), Contains("4 positions, 4 normals and 3 layers"));
  organ = good;
  organ.radius = 0.0;
  CHECK_THAT(organ_refusal(organ), Contains("the radius of the spheres is 0 m"));
  organ = good;
  organ.contact = 4;
  CHECK_THAT(organ_refusal(organ), Contains("the contact is sphere 5; expected one of 1 to 4"));
  CHECK_THAT(organ_refusal(Organ{}), Contains("has no spheres"));
}
