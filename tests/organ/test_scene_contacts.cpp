// Contacts of scenes: tools, patches and several at once, from JSON to files.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "simulated_scene.hpp"
#include "temp_folder.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/run/simulation_file.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::experiment;
using test::run_of;
using test::small_scene;
using test::TempFolder;

namespace {

/// Pressed, pulled off and left alone.
const std::string kPoke = R"("protocol": {"kind": "knots", "knots": [
  {"time": "0 s", "depth": "0 mm"}, {"time": "1 s", "depth": "5 mm"}, {"time": "3 s", "depth": "5 mm"},
  {"time": "4 s", "depth": "-2 mm"}, {"time": "6 s", "depth": "-2 mm"}]}, "outputs": {"count": 7})";
const std::string kBall = R"("contacts": [{"kind": "ball", "radius": "8 mm", "mass_kg": 0.01}], )";
const std::string kThree = R"("contacts": [{"kind": "ball", "radius": "30 mm"},
  {"kind": "punch", "radius": "35 mm", "number": 12, "share": 0.5},
  {"kind": "punch", "radius": "1 mm", "number": 20, "share": 0}], )";

/// A run that was stopped and went on.
SimulationRun stopped_and_resumed(const ExperimentScene& scene) {
  const TempFolder folder;
  SimulationControls controls;
  controls.checkpoint = folder / "c";
  int seen = 0;
  controls.interrupted = [&] { return ++seen == 120; };
  CHECK_THROWS_AS(simulate(scene, network_to_run(scene), controls), Interrupted);
  controls.interrupted = {};
  SimulationRun rest = simulate(scene, network_to_run(scene), controls);
  CHECK(rest.resumed_at_s.has_value());
  return rest;
}

}  // namespace

TEST_CASE("a scene says what meets the tissue") {
  const ExperimentScene scene = experiment(R"({"organ": {"kind": "liver"}, "contacts": [
      {"kind": "ball", "radius": "2 mm", "stiffness": "10 N/mm"},
      {"kind": "punch", "radius": "5 mm", "number": 9, "share": 0, "mass_kg": 0.2},
      {"kind": "patch", "radius": "25 mm", "number": 30, "share": 2}], )" +
                                           kPoke + "}");
  REQUIRE(scene.contacts.size() == 3);
  CHECK(scene.probe().sphere == 70);
  CHECK(scene.contacts[0].kind == ContactKind::ball);
  CHECK_THAT(scene.contacts[0].stiffness_N_per_m.value(), WithinRel(1e4, 1e-12));
  CHECK(scene.contacts[1].kind == ContactKind::punch);
  CHECK(scene.contacts[1].probe.share == 0.0);
  CHECK(scene.contacts[1].mass_kg == 0.2);
  const std::vector<std::size_t> patch = spheres_of(scene.contacts[2], scene.tissue.network.organ);
  CHECK(patch.size() > 3);
  for (const std::size_t i : patch) CHECK(scene.tissue.network.organ.layer[i] == 0);
  const DrivenNetwork driven = network_to_run(scene).driven;
  CHECK(driven.tools.size() == 2);
  CHECK(driven.spheres() == 424);
  CHECK(driven.rest.cols() == 426);
  CHECK(driven.probes.size() == 1 + patch.size());
}

TEST_CASE("the protocol of a scene is whatever that of a contact may be") {
  const std::string motion =
      R"("protocol": {"kind": "sine", "depth": "2 mm", "frequency": "7 Hz", "cycles": 2})";
  const ExperimentScene of_scene = experiment(R"({"organ": {"kind": "star"}, )" + motion + "}");
  const ExperimentScene of_contact = experiment(
      R"({"organ": {"kind": "star"}, "contacts": [{"kind": "sphere", )" + motion + "}]}");
  const auto& knots = of_scene.protocol.knots();
  REQUIRE(knots.size() == 129);
  REQUIRE(of_contact.protocol.knots().size() == knots.size());
  for (std::size_t i = 0; i < knots.size(); ++i) {
    CHECK(knots[i].time_s == of_contact.protocol.knots()[i].time_s);
    CHECK(knots[i].value == of_contact.protocol.knots()[i].value);
  }
  CHECK_THAT(of_scene.protocol.end_s(), WithinRel(2.0 / 7.0, 1e-12));
  CHECK_THAT(knots[32].value, WithinRel(0.002, 1e-12));
}

TEST_CASE("a poked liver lets go of the tool and recovers", "[heavy]") {
  const SimulationRecord record = run_of(small_scene(kBall + kPoke)).record;
  const double peak = record.curve[33].response;
  CHECK(peak > 0.05);
  for (const CurvePoint& p : record.curve) {
    CHECK(p.response >= 0.0);
    if (p.time_s >= 4.0) {
      CHECK(p.response == 0.0);
      CHECK(p.touching == 0);
    }
    CHECK(p.overlap_m < 1e-6);
  }
  const Organ organ = small_scene(kPoke).tissue.network.organ;
  const auto moved = [&](std::size_t output) {
    return (record.outputs[output].position.leftCols(organ.position.cols()) - organ.position)
        .colwise()
        .norm()
        .maxCoeff();
  };
  CHECK(moved(3) > 4e-3);
  CHECK(moved(6) < 0.25 * moved(4));  // 2 s on: exp(-2 s/1.4 s), the time in which a bond recovers
}

TEST_CASE("formulations agree on a tool where time does not matter", "[heavy]") {
  const auto end_of = [](const std::string& hold, const std::string& formulation) {
    return run_of(small_scene(kBall + R"("protocol": {"kind": "ramp_hold", "depth": "2 mm",
                    "rate": "1 mm/s", "hold": ")" +
                              hold + R"("}, "formulation": {"kind": ")" + formulation + R"("})"))
        .record.curve.back()
        .response;
  };
  CHECK_THAT(end_of("25 s", "static"), WithinRel(end_of("25 s", "quasi_static"), 1e-6));
  CHECK_THAT(end_of("1 s", "inertial"), WithinRel(end_of("1 s", "quasi_static"), 1e-3));
}

TEST_CASE("runs with tools are resumed to the bit", "[heavy]") {
  const ExperimentScene scene = small_scene(kThree + kPoke);
  const SimulationRecord whole = run_of(scene).record;
  const SimulationRun rest = stopped_and_resumed(scene);
  REQUIRE(rest.record.curve.size() == whole.curve.size());
  for (std::size_t i = 0; i < whole.curve.size(); ++i) {
    CHECK(rest.record.curve[i].response == whole.curve[i].response);
    CHECK(rest.record.curve[i].touching == whole.curve[i].touching);
    CHECK(rest.record.curve[i].overlap_m == whole.curve[i].overlap_m);
  }
}

TEST_CASE("the file of a run holds its tools and what they did", "[heavy]") {
  const TempFolder folder;
  const ExperimentScene scene = small_scene(kThree + kPoke);
  const RunNetwork network = network_to_run(scene);
  const SimulationRun run = simulate(scene, network);
  (void)write_simulation(scene, network, run, folder / "a.h5");
  const Hdf5Reader file(folder / "a.h5");
  CHECK(file.numbers("/tools/share") == std::vector<double>{1.0, 0.5, 0.0});
  CHECK(file.numbers("/curve/overlap_m").size() == run.record.curve.size());
  CHECK(file.table("/steps/00002/position_m").size() == std::size_t{3} * 60);
  const std::vector<double> force = file.table("/steps/00002/tools/force_on_tissue_N");
  double conjugate = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    conjugate += network.driven.tools[i].share *
                 Eigen::Vector3d(&force[3 * i]).dot(network.driven.tools[i].tool.direction);
  }
  CHECK_THAT(conjugate, WithinAbs(run.record.outputs[2].response, 1e-6));
  CHECK(run.record.outputs[2].response > 0.1);
}

TEST_CASE("contacts that cannot be are refused", "[heavy]") {
  const auto refused = [](const std::string& contacts, const std::string& more = kPoke) {
    CHECK_THROWS_AS(small_scene("\"contacts\": [" + contacts + "], " + more), Error);
  };
  refused(R"({"kind": "ball"})");
  refused(R"({"kind": "ball", "radius": "0 mm"})");
  refused(R"({"kind": "sphere", "radius": "2 mm"})");
  refused(R"({"kind": "ball", "radius": "2 mm", "share": 0})");
  refused(R"({"kind": "sphere", "share": -1})");
  refused(R"({"kind": "ball", "radius": "2 mm", "mass_kg": 0})");
  refused(R"({"kind": "ball", "radius": "2 mm"})",
          R"("formulation": {"kind": "inertial"}, )" + kPoke);
  refused(R"({"kind": "ball", "radius": "2 mm"})", R"("protocol": {"kind": "knots", "knots": [
    {"time": "0 s", "load": "0 N"}, {"time": "1 s", "load": "-0.1 N"}]})");
}

TEST_CASE("a tool with mass reports what the tissue feels, and what its contacts change",
          "[heavy]") {
  const std::string fast = R"("formulation": {"kind": "inertial"}, "protocol": {"kind": "knots",
    "knots": [{"time": "0 s", "depth": "0 mm"}, {"time": "40 ms", "depth": "4 mm"},
    {"time": "80 ms", "depth": "4 mm"}, {"time": "120 ms", "depth": "-40 mm"}]},
    "outputs": {"count": 9})";
  const ExperimentScene scene = small_scene(kBall + fast);
  const RunNetwork network = network_to_run(scene);
  const SimulationRun run = simulate(scene, network);
  for (const CurvePoint& p : run.record.curve) {
    CHECK(p.response >= 0.0);
    CHECK(p.force_on_tissue_N == p.response);
    if (p.touching == 0) CHECK(p.response == 0.0);
  }
  CHECK(run.record.curve.back().touching == 0);
  REQUIRE(run.contact_check.has_value());
  CHECK_FALSE(run.contact_check->depends_on_stiffness());
  CHECK(run.record.impacts.size() >= 3);
  const InertialEnergy energy = run.record.inertial_energy.value();
  CHECK(energy.contact_heat > 0.0);
  CHECK(std::abs(energy.missing()) < 0.02 * energy.work);
  const TempFolder folder;
  (void)write_simulation(scene, network, run, folder / "a.h5");
  const Hdf5Reader file(folder / "a.h5");
  CHECK(file.numbers("/impacts/time_s").size() == run.record.impacts.size());
  CHECK(file.numbers("/contact_check/difference").front() == run.contact_check->difference);
  // So soft that the numbers are those of the contact: the run says so.
  ExperimentScene soft = scene;
  soft.contacts.front().stiffness_N_per_m = 20.0;
  const SimulationRun yielding = simulate(soft, network_to_run(soft));
  CHECK(yielding.contact_check->depends_on_stiffness());
  CHECK(yielding.contact_check->largest > 0.0);  // it settles as slowly as it is pushed
}

TEST_CASE("a heavy tool under a load pushes with more than the load as it comes to rest",
          "[heavy]") {
  const ExperimentScene scene = small_scene(
      R"("contacts": [{"kind": "ball", "radius": "8 mm", "mass_kg": 0.5}],
      "formulation": {"kind": "inertial"}, "protocol": {"kind": "creep", "load": "0.1 N", "duration": "0.5 s"},
      "outputs": {"count": 11})");
  const SimulationRun run = run_of(scene);
  double largest = 0.0;
  for (const CurvePoint& p : run.record.curve) largest = std::max(largest, p.force_on_tissue_N);
  CHECK(largest > 0.12);
  // A run that was stopped goes on to the bit, impacts and forces on tissue among it.
  const SimulationRun rest = stopped_and_resumed(scene);
  REQUIRE(rest.record.curve.size() == run.record.curve.size());
  for (std::size_t i = 0; i < run.record.curve.size(); ++i) {
    CHECK(rest.record.curve[i].force_on_tissue_N == run.record.curve[i].force_on_tissue_N);
  }
  REQUIRE(rest.record.contact_pushes_N.size() == run.record.contact_pushes_N.size());
  for (std::size_t i = 0; i < run.record.contact_pushes_N.size(); ++i) {
    CHECK(rest.record.contact_pushes_N[i] == run.record.contact_pushes_N[i]);
  }
  CHECK(rest.record.impacts.size() == run.record.impacts.size());
}
