// Scenes: what is read from them, what stands, and the files of a network.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <regex>
#include <set>

#include "simulated_scene.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/scene/inspection.hpp"
#include "tpm/organ/scene/network_file.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinRel;
using Eigen::Vector3d;
using test::experiment;
using test::TempFolder;

namespace {

Tissue tissue_of(std::string_view scene) {
  return parse_tissue(parse_json(scene, "scene"), "scene", {});
}

}  // namespace

TEST_CASE("the shipped scene is the liver of the paper, held on its far side", "[heavy]") {
  const Tissue tissue = read_tissue(share_dir() / "configs" / "liver_scene.json");
  CHECK(tissue.network.organ.position == paper_liver().position);
  CHECK(tissue.anchors.size() == 69);
  CHECK(tissue.constraints().count() == 1065);  // 3 (424 - 69)
  double shallowest = 1.0;
  for (const std::size_t i : tissue.anchors) {
    shallowest =
        std::min(shallowest, tissue.network.organ.position(2, static_cast<Eigen::Index>(i)));
  }
  CHECK(shallowest > 0.13);
  CHECK_NOTHROW(require_standing(tissue, "scene"));
  const NetworkInspection seen = inspect(tissue);
  CHECK(seen.radial_bonds + seen.lateral_bonds == tissue.network.bonds.size());
  REQUIRE(seen.contact_over_star);
  CHECK_THAT(seen.contact_over_star->instantaneous, WithinRel(1.0, 1e-6));
  CHECK_THAT(seen.contact_over_star->equilibrium, WithinRel(1.0, 1e-6));
  // The defaults say the same.
  const Tissue plain = tissue_of(R"({"organ": {"kind": "liver"}})");
  CHECK(plain.anchors == tissue.anchors);
  CHECK(element_constants(plain.element()) == element_constants(tissue.element()));
}

TEST_CASE("every key of a scene reaches the tissue") {
  const Tissue tissue = tissue_of(R"({"title": "t",
    "organ": {"kind": "block", "cells": [3, 3, 2], "spacing": "10 mm", "lattice": "cubic", "contact": 5},
    "bonds": {"support": 1.8, "rule": "per_bond", "spacing_law": "continuum",
              "reference_spacing": "5 mm", "lateral": "rope"},
    "material": {"E1": "1 kPa", "E2": "2 kPa", "Eprime": "3 kPa", "eta1": "4 Pa s",
                 "A0": "5 mm^2", "l0": "6 mm"},
    "anchors": [{"kind": "inner_layer"}, {"kind": "spheres", "spheres": [1, 48]},
                {"kind": "half_space", "point": ["0 mm", "25 mm", "0 mm"], "normal": [0, 2, 0]}],
    "sliders": [6], "contacts": [{"kind": "sphere"}],
    "protocol": {"kind": "creep", "load": "1 N", "duration": "1 s"}})");
  const Organ& organ = tissue.network.organ;
  REQUIRE(organ.size() == 48);
  CHECK(organ.contact == 4U);
  CHECK(organ.spacing == 0.010);
  CHECK(tissue.network.options.support == 1.8);
  CHECK(tissue.network.options.rule == StiffnessRule::per_bond);
  CHECK(tissue.network.options.spacing_law == SpacingLaw::continuum);
  CHECK_THAT(tissue.network.bonds.front().factor, WithinRel(2.0, 1e-12));
  CHECK(tissue.materials.lateral() == LateralBond::tension_only);
  const TpmVector expected{1e3, 2e3, 3e3, 4.0, 0.010, 5e-6, 6e-3};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK_THAT(element_constants(tissue.element())[i], WithinRel(expected[i], 1e-14));
  }
  // The bottom plane of 16, sphere 1, and the rows y = 30 mm of the two planes above.
  CHECK(tissue.anchors.size() == 16 + 1 + 8);
  CHECK(tissue.anchor_words.size() == 3);
  REQUIRE(tissue.sliders.size() == 1);
  CHECK(tissue.sliders[0].sphere == 5);
  CHECK(tissue.unused_blocks == std::vector<std::string>{"contacts", "protocol"});
}

TEST_CASE("a star in a scene is the element: B guided, the others held, three bonds") {
  const Tissue tissue =
      tissue_of(R"({"organ": {"kind": "star", "spacing": "30 mm", "length": "20 mm"}})");
  CHECK(tissue.network.bonds.size() == 3);
  CHECK(tissue.constraints().count() == 1);
  for (const Bond& bond : tissue.network.bonds) CHECK_THAT(bond.factor, WithinRel(1.0, 1e-12));
  CHECK_NOTHROW(require_standing(tissue, "scene"));
}

TEST_CASE("three layers, more spheres, and a solid filling stand too", "[heavy]") {
  for (const char* scene :
       {R"({"organ": {"kind": "liver", "layers": 3}})",
        R"({"organ": {"kind": "liver", "count": 2000, "shape": {"width": "210 mm"}}})",
        R"({"organ": {"kind": "liver", "filling": "solid", "count": 1000}})"}) {
    CAPTURE(scene);
    CHECK_NOTHROW(require_standing(tissue_of(scene), "scene"));
  }
}

TEST_CASE("a mesh's spheres listed in its place are the same tissue without the file") {
  const TempFolder folder;
  std::string cube = "o cube\n";
  for (int i = 0; i < 8; ++i) cube += fmt::format("v {} {} {}\n", i & 1, (i >> 1) & 1, i >> 2);
  for (const char* face : {"1 3 4", "1 4 2", "5 6 8", "5 8 7", "1 2 6", "1 6 5", "3 7 8", "3 8 4",
                           "1 5 7", "1 7 3", "2 4 8", "2 8 6"}) {
    cube += fmt::format("f {}\n", face);
  }
  write_file(folder / "cube.obj", cube);
  const Json scene = parse_json(R"({"description": "A cube.", "organ": {"kind": "mesh",
    "mesh": "cube.obj", "unit": "cm", "count": 60, "layers": 2},
    "anchors": [{"kind": "inner_layer"}]})",
                                "scene");
  const Tissue filled = parse_tissue(scene, "scene", folder.path());
  const Json alone = with_mesh_listed(scene, "scene", folder.path());
  std::filesystem::remove(folder / "cube.obj");
  const Tissue listed = parse_tissue(alone, "scene", {});
  const Organ &a = filled.network.organ, &b = listed.network.organ;
  CHECK(a.position == b.position);
  CHECK((a.normal - b.normal).cwiseAbs().maxCoeff() < 1e-15);
  CHECK((a.layer == b.layer && a.contact == b.contact && filled.anchors == listed.anchors));
  CHECK_THAT(b.radius, WithinRel(a.radius, 1e-15));
  CHECK((filled.bonds().rest_length_m() == listed.bonds().rest_length_m()));
  CHECK_THAT(alone.at("description").get<std::string>(),
             StartsWith("A cube. Its spheres fill the mesh cube.obj, SHA-256 "));
  CHECK(with_mesh_listed(alone, "scene", {}) == alone);
}

TEST_CASE("a load must be able to move its sphere") {
  const Tissue tissue = tissue_of(R"({"organ": {"kind": "star"}})");
  CHECK_NOTHROW(require_loadable(tissue, 1, Vector3d::UnitZ(), "contacts/0"));
  CHECK_THROWS_WITH(require_loadable(tissue, 0, Vector3d::UnitZ(), "contacts/0"),
                    Contains("a load on sphere 1, which is anchored"));
  CHECK_THROWS_WITH(require_loadable(tissue, 1, Vector3d::UnitX(), "contacts/0"),
                    Contains("square to its guide"));
  CHECK_THROWS_WITH(require_loadable(tissue, 4, Vector3d::UnitX(), "contacts/0"),
                    Contains("no sphere 5"));
}

TEST_CASE("an anchored contact sphere refuses only scenes that push it") {
  const std::string liver = R"({"organ": {"kind": "liver", "count": 60})";
  const std::size_t contact = tissue_of(liver + "}").network.organ.contact.value() + 1;
  const std::string anchored =
      liver + R"(, "anchors": [{"kind": "spheres", "spheres": [)" + std::to_string(contact) +
      R"(]}, {"kind": "inner_layer"}], "protocol": {"kind": "ramp_hold", "depth": "1 mm",
         "rate": "4 mm/s", "hold": "1 s"})";
  const std::string is_anchored = fmt::format("sphere {}, which is anchored", contact);
  const Tissue tissue = tissue_of(anchored + "}");
  CHECK_NOTHROW(require_standing(tissue, "scene"));
  CHECK_THROWS_WITH(require_free_contact(tissue, "scene"), Contains("is anchored"));
  CHECK_THROWS_WITH(experiment(anchored + "}"), Contains(is_anchored));
  const std::string other = fmt::format(R"(, "contacts": [{{"kind": "sphere", "number": {}}}]}})",
                                        contact == 1 ? 2 : contact - 1);
  CHECK_NOTHROW(experiment(anchored + other));
}

TEST_CASE("an organ that nothing holds has the six motions of a rigid body") {
  const Tissue tissue = tissue_of(R"({"organ": {"kind": "block", "cells": [3, 3, 3]}})");
  CHECK_THROWS_WITH(require_standing(tissue, "scene"),
                    StartsWith("scene: not anchored: 6 zero-energy modes"));
  CHECK_NOTHROW(require_sound(tissue, "scene"));  // its bonds hold every sphere
}

TEST_CASE("a network in HDF5 holds its spheres and bonds, and the XDMF names only what is there") {
  const TempFolder folder;
  const Tissue tissue = tissue_of(R"({"organ": {"kind": "liver"}})");
  const auto xdmf = write_network(tissue, folder / "a.h5");
  CHECK(xdmf == std::filesystem::path(folder / "a.xdmf"));
  const Hdf5Reader file(folder / "a.h5");
  const std::vector<double> factor = file.numbers("/bonds/factor");
  REQUIRE(factor.size() == tissue.network.bonds.size());
  CHECK(factor.back() == tissue.network.bonds.back().factor);
  CHECK(file.numbers("/bonds/rest_length_m").front() == tissue.network.bonds.front().rest_length_m);
  CHECK(file.numbers("/spacing_m") == std::vector<double>{0.020});
  const std::string text = read_file(xdmf);
  const std::regex reference("a\\.h5:([^<]+)<");
  std::set<std::string> named;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), reference);
       it != std::sregex_iterator(); ++it) {
    named.insert((*it)[1]);
  }
  CHECK(named.size() == 13);
  for (const std::string& name : named) CHECK(file.has(name));
  // The same scene gives the same bytes.
  write_network(tissue, folder / "b.h5");
  CHECK(read_file(folder / "a.h5") == read_file(folder / "b.h5"));
}

TEST_CASE("tpm network show draws the liver as PNG and SVG, twice the same") {
  const TempFolder folder;
  const std::string show =
      std::string("\"") + TPM_TEST_PROGRAM + "\" network show --spheres 100 -o \"";
  REQUIRE(std::system((show + (folder / "a") + "\" >/dev/null").c_str()) == 0);
  REQUIRE(std::system((show + (folder / "b.png") + "\" >/dev/null").c_str()) == 0);
  CHECK(read_file(folder / "a.svg") == read_file(folder / "b.svg"));
  CHECK(read_file(folder / "a.png").starts_with("\x89PNG"));
  CHECK(read_file(folder / "a.pdf").starts_with("%PDF"));
  CHECK(read_file(folder / "a.pdf") == read_file(folder / "b.pdf"));
  CHECK_THAT(read_file(folder / "a.svg"), Contains("<svg"));
}
