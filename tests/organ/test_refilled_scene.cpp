// One body by more or fewer spheres: what stays, and what has no limit.
#include <catch2/catch.hpp>
#include <cmath>

#include "refusal.hpp"
#include "tpm/organ/scene/refilled_scene.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::refusal_of;

namespace {

const std::string kRest = R"("bonds": {"spacing_law": "continuum"},
  "protocol": {"kind": "ramp_hold", "depth": "1 mm", "rate": "1 mm/s", "hold": "1 s"}, )";
const std::string kPatch = R"("contacts": [{"kind": "patch", "radius": "25 mm"}])";

RefilledScene scene_of(const std::string& blocks) {
  return {parse_json("{" + kRest + blocks + "}", "s.json"), "s.json", {}};
}

Eigen::Vector3d extent(const Organ& organ) {
  return organ.position.rowwise().maxCoeff() - organ.position.rowwise().minCoeff();
}

std::string why_not(const std::string& text) {
  return refusal_of([&] { (void)RefilledScene(parse_json(text, "s.json"), "s.json", {}); });
}

}  // namespace

TEST_CASE("a shell keeps its size and its thickness") {
  const RefilledScene refilled =
      scene_of(R"("organ": {"kind": "liver", "count": 212, "spacing": "20 mm"}, )" + kPatch);
  const Organ& own = refilled.own().tissue.network.organ;
  const auto fillings = refilled.fillings(100, 2000);
  REQUIRE(fillings.size() == 3);  // 2, 3 and 4 layers
  CHECK(fillings[0].finer == 1.0);
  CHECK(fillings[1].finer == 1.5);
  CHECK(fillings[1].spheres == 716);  // 212 times 1.5 cubed
  const ExperimentScene finer = refilled.scene(fillings[1]);
  const Organ& organ = finer.tissue.network.organ;
  CHECK(organ.layer_count() == 3);
  CHECK(organ.size() == 716);
  CHECK_THAT(organ.spacing * 1.5, WithinRel(own.spacing, 0.02));
  for (Eigen::Index i = 0; i < 3; ++i) {
    CHECK_THAT(extent(organ)(i), WithinRel(extent(own)(i), 0.05));
  }
}

TEST_CASE("a contact keeps its place and its direction") {
  const RefilledScene refilled = scene_of(
      R"("organ": {"kind": "block", "cells": [4, 4, 2], "spacing": "20 mm", "lattice": "cubic"},
         "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"], "normal": [0, 0, -1]}],
         "contacts": [{"kind": "patch", "number": 13, "radius": "25 mm"}])");
  const Organ& own = refilled.own().tissue.network.organ;
  const Probe& probe = refilled.own().probe();
  const auto fillings = refilled.fillings(50, 1000);
  REQUIRE(fillings.size() >= 2);
  for (const RefilledScene::Filling& filling : fillings) {
    const ExperimentScene scene = refilled.scene(filling);
    const Organ& organ = scene.tissue.network.organ;
    const auto away = organ.position.col(static_cast<Eigen::Index>(scene.probe().sphere)) -
                      own.position.col(static_cast<Eigen::Index>(probe.sphere));
    CHECK(away.norm() <= organ.spacing);
    CHECK((scene.probe().direction - probe.direction).norm() < 1e-12);
    CHECK((extent(organ) - extent(own)).norm() < 1e-12);
    CHECK_THAT(organ.spacing * filling.finer, WithinRel(own.spacing, 1e-12));
  }
}

TEST_CASE("what has no limit for small spheres is refused with its key") {
  const std::string liver = R"("organ": {"kind": "liver", "count": 60}, )";
  const std::string protocol =
      R"("protocol": {"kind": "ramp_hold", "depth": "1 mm", "rate": "1 mm/s", "hold": "1 s"})";
  CHECK_THAT(why_not("{" + liver + kPatch + ", " + protocol + "}"),
             Contains("/bonds/spacing_law") && Contains("continuum"));
  CHECK_THAT(why_not("{" + kRest + R"("organ": {"kind": "liver", "count": 60}})"),
             Contains("/contacts/0/kind") && Contains("patch, ball or punch"));
  CHECK_THAT(why_not("{" + kRest + liver +
                     R"("anchors": [{"kind": "spheres", "spheres": [50, 51, 52, 53]}], )" +
                     R"("contacts": [{"kind": "patch", "radius": "10 mm"}]})"),
             Contains("/anchors/0/kind"));
  CHECK_THAT(why_not("{" + kRest + liver + R"("material": {"regions": [{"kind": "layer", "layer": 1,
                     "factor": 2}]}, "contacts": [{"kind": "patch", "radius": "10 mm"}]})"),
             Contains("/material/regions/0/kind"));
}
