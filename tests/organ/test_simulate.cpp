// tpm simulate: what a scene says is done to a tissue, runs that are stopped and go on, limits of
// validity, the mass-spring model beside it.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <limits>
#include <random>
#include <sstream>

#include "refusal.hpp"
#include "simulated_scene.hpp"
#include "temp_folder.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/balance/mass_spring.hpp"
#include "tpm/organ/run/smoothness.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::experiment;
using test::refusal_of;
using test::run_of;
using test::small_scene;
using test::TempFolder;

namespace {

const std::string kPush = R"("protocol": {"kind": "ramp_hold", "depth": "6 mm", "rate": "4 mm/s",
  "hold": "5 s"})";
const std::string kLoad = R"("protocol": {"kind": "knots", "knots": [
  {"time": "0 s", "load": "0 N"}, {"time": "1 s", "load": "0 N"}, {"time": "2 s", "load": "0.2 N"},
  {"time": "4 s", "load": "0.2 N"}, {"time": "4 s", "load": "0.1 N"}, {"time": "6 s", "load": "0.1 N"}]})";
const std::string kStatic = R"("formulation": {"kind": "static"}, )";
const std::string kMoving = R"("formulation": {"kind": "inertial"}, )";

void check_same(const SimulationRecord& a, const SimulationRecord& b) {
  REQUIRE(a.curve.size() == b.curve.size());
  for (std::size_t i = 0; i < a.curve.size(); ++i) {
    CAPTURE(i, a.curve[i].time_s);
    CHECK(a.curve[i].time_s == b.curve[i].time_s);
    CHECK(a.curve[i].response == b.curve[i].response);
    CHECK(a.curve[i].energy.work_J == b.curve[i].energy.work_J);
    CHECK(a.curve[i].energy.dissipated_J == b.curve[i].energy.dissipated_J);
  }
  REQUIRE(a.outputs.size() == b.outputs.size());
  for (std::size_t i = 0; i < a.outputs.size(); ++i) {
    CHECK(a.outputs[i].position == b.outputs[i].position);
    CHECK(a.outputs[i].viscous == b.outputs[i].viscous);
  }
  CHECK(a.error_estimate == b.error_estimate);
  CHECK(a.validity.deepest_m == b.validity.deepest_m);
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    CHECK(a.validity.breach[k].first_time_s == b.validity.breach[k].first_time_s);
    CHECK(a.validity.breach[k].spheres == b.validity.breach[k].spheres);
  }
}

}  // namespace

TEST_CASE("every block of a scene reaches the experiment") {
  const ExperimentScene scene = experiment(R"({"organ": {"kind": "liver", "count": 60},
    "contacts": [{"kind": "sphere", "number": 7, "direction": [0, 0, 2]}],
    "protocol": {"kind": "creep", "load": "30 mN", "duration": "2 s"},
    "formulation": {"kind": "inertial", "damping_ratio": 0.3, "density_kg_per_m3": 1000,
                    "comparison": "mass_spring", "springs": "equal"},
    "outputs": {"times": ["2 s", "1 s"], "fields": ["viscous"]}, "tolerance": 1e-4})");
  CHECK(scene.probe().sphere == 6);
  CHECK(scene.probe().direction == Eigen::Vector3d::UnitZ());
  CHECK(scene.protocol.drive() == Drive::force);
  CHECK_THAT(scene.protocol.peak(), WithinRel(0.03, 1e-12));
  CHECK(scene.formulation.kind == "inertial");
  CHECK(scene.formulation.damping_ratio == 0.3);
  CHECK(scene.formulation.density_kg_m3 == 1000.0);
  CHECK(scene.formulation.mass_spring);
  CHECK(scene.formulation.springs == SpringRule::equal);
  CHECK(scene.formulation.tolerance == 1e-4);
  CHECK(scene.outputs.times_s == std::vector<double>{1.0, 2.0});
  CHECK_FALSE(scene.outputs.force);
  CHECK(scene.outputs.viscous);
  CHECK(scene.tissue.unused_blocks.empty());
}

TEST_CASE("a contact is found by its place") {
  const std::string at = R"("contacts": [{"kind": "sphere", "at": ["2 mm", "136 mm", "57 mm"]}], )";
  const std::string push = R"("protocol": {"kind": "step_hold", "depth": "1 mm", "hold": "1 s"}})";
  CHECK(experiment(R"({"organ": {"kind": "liver"}, )" + at + push).probe().sphere == 70);
}

TEST_CASE("outputs by number and by spacing, the ends among them", "[heavy]") {
  const auto times = [](const std::string& outputs) {
    return small_scene(kPush + ", \"outputs\": {" + outputs + "}").outputs.times_s;
  };
  CHECK(times(R"("count": 3)") == std::vector<double>{0.0, 3.25, 6.5});
  CHECK(times(R"("count": 1)") == std::vector<double>{6.5});
  CHECK(times(R"("spacing": "2 s")") == std::vector<double>{0.0, 2.0, 4.0, 6.0, 6.5});
  CHECK(small_scene(kPush).outputs.times_s.size() == 61);
}

TEST_CASE("a run in parts is the run of the whole, within its tolerance", "[heavy]") {
  for (const std::string& protocol : {kPush, kLoad}) {
    const ExperimentScene scene = small_scene(protocol);
    SimulationRecord record = run_of(scene).record;
    // The side before a jump is one of them.
    std::erase_if(record.curve, [](const CurvePoint& p) { return p.between; });
    std::vector<double> times;
    for (const CurvePoint& p : record.curve) times.push_back(p.time_s);
    const BondSystem bonds = scene.tissue.bonds();
    const QuasiStaticRun whole =
        QuasiStatic(bonds, scene.tissue.network.organ.position, scene.tissue.constraints(),
                    scene.probe(), {.tolerance = scene.formulation.tolerance})
            .run(scene.protocol, times);
    const double peak = whole.response.cwiseAbs().maxCoeff();
    for (std::size_t i = 0; i < times.size(); ++i) {
      CAPTURE(times[i]);
      CHECK_THAT(record.curve[i].response, WithinAbs(whole.response[static_cast<Eigen::Index>(i)],
                                                     3 * scene.formulation.tolerance * peak));
      CHECK_THAT(record.curve[i].imposed, WithinAbs(value_at(scene.protocol, times[i]), 1e-15));
    }
    CHECK(record.error_estimate < 2 * scene.formulation.tolerance * peak);
  }
}

TEST_CASE("a scene names its solver; runs without mass answer with either", "[heavy]") {
  for (const std::string kind : {"quasi_static", "static"}) {
    const auto run = [&](const std::string& solver) {
      return run_of(small_scene(fmt::format(
          R"("formulation": {{"kind": "{}", "solver": "{}"}}, {})", kind, solver, kPush)));
    };
    const SimulationRun direct = run("direct");
    const SimulationRun iterative = run("iterative");
    CAPTURE(kind);
    REQUIRE(direct.solver);
    REQUIRE(iterative.solver);
    CHECK(direct.solver->direct);
    CHECK_FALSE(iterative.solver->direct);
    REQUIRE(direct.record.curve.size() == iterative.record.curve.size());
    for (std::size_t i = 0; i < direct.record.curve.size(); ++i) {
      CHECK_THAT(iterative.record.curve[i].response,
                 WithinAbs(direct.record.curve[i].response, 1e-5));
    }
  }
  CHECK_THAT(
      refusal_of([] {
        (void)small_scene(R"("formulation": {"kind": "inertial", "solver": "direct"}, )" + kPush);
      }),
      Contains("/formulation/solver"));
}

TEST_CASE("an interrupted run goes on to the same result, to the bit", "[heavy]") {
  for (const std::string& protocol :
       {kPush, kLoad, kStatic + kPush, kMoving + kPush, kMoving + kLoad}) {
    const ExperimentScene scene = small_scene(protocol);
    const SimulationRecord whole = run_of(scene).record;
    for (const std::size_t stop_at : {3UL, 3 * whole.curve.size() / 4, whole.curve.size() - 1}) {
      const TempFolder folder;
      CAPTURE(protocol, stop_at);
      SimulationControls controls;
      controls.checkpoint = folder / "c";
      std::size_t seen = 0;
      controls.interrupted = [&] { return ++seen == stop_at; };
      std::string message;
      try {
        (void)simulate(scene, network_to_run(scene), controls);
      } catch (const Interrupted& stop) {
        message = stop.what();
      }
      CHECK_THAT(message, Contains("interrupted at t = "));
      // Too early for a checkpoint, there is none; the run then starts anew.
      CHECK(std::filesystem::exists(controls.checkpoint) == (stop_at > 3));
      const SimulationRun rest = simulate(scene, network_to_run(scene), controls);
      CHECK(rest.resumed_at_s.has_value() == (stop_at > 3));
      check_same(rest.record, whole);
    }
  }
}

TEST_CASE("a checkpoint of a whole run is answered without running again", "[heavy]") {
  const ExperimentScene scene = small_scene(kPush);
  const TempFolder folder;
  SimulationControls controls;
  controls.checkpoint = folder / "c";
  controls.checkpoint_every_s = 0.0;
  const SimulationRun first = simulate(scene, network_to_run(scene), controls);
  int points = 0;
  controls.progress = [&](std::size_t, std::size_t) { ++points; };
  const SimulationRun again = simulate(scene, network_to_run(scene), controls);
  CHECK(points == 0);
  CHECK(again.resumed_at_s == 6.5);
  check_same(again.record, first.record);
}

TEST_CASE("the checkpoint of another scene is not used, and that is said", "[heavy]") {
  const TempFolder folder;
  SimulationControls controls;
  controls.checkpoint = folder / "c";
  controls.checkpoint_every_s = 0.0;
  const ExperimentScene scene = small_scene(kPush);
  (void)simulate(scene, network_to_run(scene), controls);
  std::string note;
  controls.note = [&](const std::string& text) { note = text; };
  const ExperimentScene other = small_scene(kPush + R"(, "tolerance": 1e-5)");
  const SimulationRun run = simulate(other, network_to_run(other), controls);
  CHECK_FALSE(run.resumed_at_s);
  CHECK_THAT(note, Contains("of another scene"));
  ExperimentScene springs = other;
  springs.formulation.mass_spring = true;
  note.clear();
  CHECK_FALSE(simulate(springs, network_to_run(springs), controls).resumed_at_s);
  CHECK_THAT(note, Contains("of another scene"));
}

TEST_CASE("a load put on at once does not step over an instability", "[heavy]") {
  const auto end_of = [](double load_N) -> std::string {
    const ExperimentScene scene = small_scene(
        fmt::format(R"("protocol": {{"kind": "knots", "knots": [{{"time": "0 s", "load": "0 N"}},
          {{"time": "1 s", "load": "0 N"}}, {{"time": "1 s", "load": "{} N"}},
          {{"time": "1.001 s", "load": "{} N"}}]}})",
                    load_N, load_N));
    try {
      return fmt::format("{:.6f}", run_of(scene).record.curve.back().response);
    } catch (const Error& stop) {
      return stop.what();
    }
  };
  CHECK_THAT(end_of(0.9), !Contains("buckles"));
  for (const double load : {1.0, 1.2, 1.6, 1.8, 2.4, 3.5}) {
    CAPTURE(load);
    CHECK_THAT(end_of(load), Contains("a load of 0.9359 N the tissue buckles"));
  }
}

TEST_CASE("limits of validity are dated and name their spheres", "[heavy]") {
  const auto deep_in = [](const std::string& organ, const std::string& depth) {
    return run_of(experiment(R"({"organ": {"kind": "liver", "count": 60)" + organ +
                             R"(}, "material": {"eta1": "16800 Pa s"},
           "protocol": {"kind": "ramp_hold", "depth": ")" +
                             depth + R"(", "rate": "1 mm/s", "hold": "1 s"}})"))
        .record.validity;
  };
  const auto deep = [&](const std::string& depth) {
    return deep_in(R"(, "shape": {"width": "210 mm"})", depth);
  };
  // A liver of half the paper's width: 10 and 12 mm say nothing of it.
  const Validity small =
      deep_in(R"(, "shape": {"width": "105 mm", "height": "80 mm", "depth": "50 mm"})", "13 mm");
  CHECK_THAT(small.deepest_m, WithinRel(0.013, 1e-12));
  CHECK_FALSE(small.of(ValidityLimit::indentation).first_time_s);
  CHECK_FALSE(small.of(ValidityLimit::damage).first_time_s);
  CHECK(deep("9.9 mm").whole());
  const Validity seen = deep("13 mm");
  CHECK_THAT(seen.deepest_m, WithinRel(0.013, 1e-12));
  const double step_s = 14.0 / 200;  // a run is watched that often
  for (const auto& [limit, depth_mm] :
       {std::pair{ValidityLimit::indentation, 10.0}, {ValidityLimit::damage, 12.0}}) {
    const ValidityBreach& breach = seen.of(limit);
    REQUIRE(breach.first_time_s);
    CHECK(*breach.first_time_s > depth_mm);
    CHECK(*breach.first_time_s <= depth_mm + step_s);
    CHECK(breach.spheres == std::vector<std::size_t>{small_scene(kPush).probe().sphere});
  }
  CHECK_FALSE(deep("12 mm").of(ValidityLimit::damage).first_time_s);
}

TEST_CASE("a lateral bond of the star turns as the paper's angle says") {
  // tan(theta) = e/x: 30 degrees at e = 10 mm are reached where x = 17.32 mm.
  const auto turned = [](const std::string& spacing) {
    const ExperimentScene scene =
        experiment(R"({"organ": {"kind": "star", "length": "40 mm", "spacing": ")" + spacing +
                   R"("}, "contacts": [{"kind": "sphere", "number": 2, "direction": [0, 0, -1]}],
           "protocol": {"kind": "ramp_hold", "depth": "10 mm", "rate": "4 mm/s", "hold": "1 s"}})");
    return run_of(scene).record.validity;
  };
  CHECK_THAT(turned("30 mm").most_turned_rad, WithinRel(std::atan(1.0 / 3.0), 1e-9));
  CHECK_FALSE(turned("17.4 mm").of(ValidityLimit::turning).first_time_s);
  const ValidityBreach breach = turned("17.3 mm").of(ValidityLimit::turning);
  REQUIRE(breach.first_time_s);
  CHECK(breach.spheres == std::vector<std::size_t>{0, 1, 2});
}

TEST_CASE("the bonds that have turned are found whatever moves them") {
  const ExperimentScene scene = small_scene(kPush);
  const Network& network = scene.tissue.network;
  const Positions& rest = network.organ.position;
  std::mt19937 random(0);
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  ValidityWatch watch(scene);
  double most_rad = 0.0;
  // By 0.1 to 30 mm each on its own; then also carried along with all others, which turns nothing.
  for (const double size_m : {1e-4, 1e-3, 4e-3, 8e-3, 3e-2}) {
    for (const double carried_m : {0.0, 0.5}) {
      Positions moved = rest;
      for (double& coordinate : moved.reshaped()) coordinate += carried_m + size_m * part(random);
      std::vector<bool> turned(network.organ.size(), false);
      for (const Bond& bond : network.bonds) {
        if (bond.kind != BondKind::lateral) continue;
        const Eigen::Vector3d before = (rest.col(bond.b) - rest.col(bond.a)).normalized();
        const Eigen::Vector3d now = (moved.col(bond.b) - moved.col(bond.a)).normalized();
        // The half of the angle, from the chord and its complement.
        const double angle = 2.0 * std::atan2((now - before).norm(), (now + before).norm());
        most_rad = std::max(most_rad, angle);
        if (angle > kValidTurning_rad) turned[bond.a] = turned[bond.b] = true;
      }
      const std::vector<std::int32_t> flags = watch.flags(moved);
      watch.see(size_m, moved);
      CAPTURE(size_m, carried_m);
      CHECK_THAT(watch.seen().most_turned_rad, WithinAbs(most_rad, 1e-9));
      for (std::size_t i = 0; i < flags.size(); ++i) CHECK(((flags[i] & 4) != 0) == turned[i]);
    }
  }
}

TEST_CASE("static states are those that a load held for ever reaches", "[heavy]") {
  const ExperimentScene scene = small_scene(kStatic + kLoad);
  const SimulationRecord record = run_of(scene).record;
  const double forever = std::numeric_limits<double>::infinity();
  const BondSystem bonds = scene.tissue.bonds();
  const QuasiStatic equations(bonds, scene.tissue.network.organ.position,
                              scene.tissue.constraints(), scene.probe(), {.tolerance = 1e-8});
  for (const double load : {0.1, 0.2}) {
    const double depth = equations.run(creep(load, forever), {&forever, 1}).response[0];
    for (const CurvePoint& p : record.curve) {
      if (p.imposed == load) CHECK_THAT(p.response, WithinRel(depth, 1e-6));
    }
  }
  CHECK(record.curve.front().response == 0.0);
  CHECK_THAT(record.curve.back().energy.work_J,
             WithinRel(record.curve.back().energy.stored_J, 1e-9));
}

TEST_CASE("the mass-spring model meets a small depth with the tissue's relaxed force", "[heavy]") {
  const std::string push = R"("protocol": {"kind": "step_hold", "depth": "1 um", "hold": "1 s"}, )";
  const ExperimentScene tissue = small_scene(push + kStatic + R"("title": "t")");
  ExperimentScene springs = tissue;
  springs.formulation.mass_spring = true;
  const double force = run_of(tissue).record.curve.back().response;
  CHECK(force > 0.0);
  CHECK_THAT(run_of(springs).record.curve.back().response, WithinRel(force, 1e-4));
}

TEST_CASE("a slow push of spheres with mass is the quasi-static one, and its energy closes",
          "[heavy]") {
  const std::string slow =
      R"("protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "1 mm/s", "hold": "8 s"})";
  const SimulationRun moving =
      run_of(small_scene(slow + R"(, "formulation": {"kind": "inertial"})"));
  const SimulationRun still = run_of(small_scene(slow));
  const double force = still.record.curve.back().response;
  CHECK_THAT(moving.record.curve.back().response, WithinAbs(force, 2e-3 * force));
  CHECK(moving.record.outputs.size() == still.record.outputs.size());
  const std::optional<InertialEnergy> energy = moving.record.inertial_energy;
  REQUIRE(energy);
  CHECK(std::abs(energy->missing()) < 1e-2 * energy->work);
}

TEST_CASE("roughness is stated where something has moved", "[heavy]") {
  const ExperimentScene scene = small_scene(kPush);
  const SimulationRecord record = run_of(scene).record;
  CHECK_FALSE(smoothness_of(scene, record.outputs.front().position));
  const auto found = smoothness_of(scene, record.outputs.back().position);
  REQUIRE(found);
  CHECK(found->near_contact > 0.0);
  CHECK(found->near_contact < 1.0);
}

TEST_CASE("a tissue that may snap through is named with the place where it is softest") {
  const std::string refusal = refusal_of([] {
    (void)run_of(small_scene(
        R"("anchors": [{"kind": "inner_layer"}], "contacts": [{"kind": "sphere", "number": 13}],
           "protocol": {"kind": "ramp_hold", "depth": "40 mm", "rate": "40 mm/s", "hold": "1 s"})"));
  });
  CHECK_THAT(refusal, Contains("it may snap through around sphere ") && Contains(" mm"));
}

TEST_CASE("a load that nothing carries is refused where the tissue collapses", "[heavy]") {
  CHECK_THAT(refusal_of([] {
               (void)run_of(small_scene(
                   R"("formulation": {"kind": "static", "solver": "iterative"},
                      "protocol": {"kind": "creep", "load": "1e6 N", "duration": "1 s"})"));
             }),
             Contains("buckles around sphere "));
  CHECK_THAT(refusal_of([] {
               (void)run_of(small_scene(
                   R"("protocol": {"kind": "creep", "load": "1e6 N", "duration": "1 s"})"));
             }),
             Contains("at t = 0 s and a load of 0.93") && Contains("buckles around sphere "));
  // The place is that of the sphere which is named: the pushed one, or a weak one beside it.
  for (const auto& [formulation, named] :
       {std::pair{R"("static")", 13}, std::pair{R"("quasi_static")", 20}}) {
    const ExperimentScene scene = small_scene(fmt::format(
        R"("formulation": {{"kind": {}}}, "contacts": [{{"kind": "sphere", "number": 20}}],
           "protocol": {{"kind": "creep", "load": "1e6 N", "duration": "1 s"}})",
        formulation));
    const std::string refusal = refusal_of([&] { (void)run_of(scene); });
    CAPTURE(refusal);
    const std::string words = fmt::format("buckles around sphere {} at (", named);
    const std::size_t at = refusal.find(words);
    REQUIRE(at != std::string::npos);
    std::istringstream numbers(refusal.substr(at + words.size()));
    const Eigen::Vector3d rest_m = scene.tissue.network.organ.position.col(named - 1);
    for (int axis = 0; axis < 3; ++axis) {
      double place_mm = 0.0;
      char separator = 0;
      numbers >> place_mm >> separator;
      CHECK_THAT(1e-3 * place_mm, WithinAbs(rest_m[axis], 0.02));  // it has moved
    }
  }
}

TEST_CASE("lists of a session and of a design's candidates are protocols of the one parser") {
  const DocumentPlace place{"f.json"};
  const auto parsed = [&](const std::string& text) {
    const Block<ProtocolLists> block(
        "lists", "", protocol_list_keys(ProtocolKind::ramp_hold, {{"rate", "rates"}}));
    return combinations(ProtocolKind::ramp_hold, block.read(parse_json(text, "f.json"), place),
                        place);
  };
  const std::vector<ProtocolBlock> all =
      parsed(R"({"depth": ["1 mm", "2 mm"], "rates": ["1 mm/s", "4 mm/s"], "hold": "3 s"})");
  REQUIRE(all.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(*all[i].depth_m == Approx(i < 2 ? 1e-3 : 2e-3));
    CHECK(*all[i].rate_m_per_s == Approx(i % 2 == 0 ? 1e-3 : 4e-3));
    CHECK(all[i].protocol(place).end_s() == Approx(*all[i].depth_m / *all[i].rate_m_per_s + 3.0));
  }
  struct Case {
    const char *text, *expected;
  };
  for (const Case& c : {Case{R"({"depth": ["1 mm", "0 mm"], "rates": "1 mm/s", "hold": "3 s"})",
                             "f.json: key /depth/1: 0 m; expected above 0 m"},
                        Case{R"({"depth": "1 mm", "rates": ["1 mm"], "hold": "3 s"})",
                             "f.json: key /rates/0: 'mm' is a unit of length"},
                        Case{R"({"depth": "1 mm", "hold": "3 s"})",
                             "key /rates: is missing; expected speed of the ramp"},
                        Case{R"({"depth": "1 mm", "rate": "1 mm/s", "hold": "3 s"})",
                             "key /rate: unknown key (did you mean 'rates'?); expected one of "
                             "depth, rates, hold"}}) {
    CHECK_THAT(refusal_of([&] { (void)parsed(c.text); }), Contains(c.expected));
  }
}

TEST_CASE("a protocol that a scene misstates is refused at its key") {
  const auto scene_with = [](const std::string& protocol) {
    return refusal_of([&] {
      (void)checked(parse_json(R"({"organ": {"kind": "star"}, "protocol": )" + protocol + "}", "s"),
                    scene_kind(), "s.json");
    });
  };
  CHECK_THAT(
      scene_with(R"({"kind": "creep", "load": 1, "duration": "1 s"})"),
      Contains(
          "s.json: key /protocol/load: is of the wrong type: 1; expected a text of a number and "
          "a unit of force"));
  CHECK_THAT(scene_with(R"({"kind": "poke"})"),
             Contains("expected one of ramp_hold, step_hold, creep, knots"));
  CHECK_THAT(scene_with(R"({"kind": "knots", "knots": [{"depth": "1 mm"}, {"time": "1 s"}]})"),
             Contains("key /protocol/knots/0/time: is missing"));
  CHECK_THAT(scene_with(R"({"kind": "creep", "lode": "1 N"})"),
             Contains("key /protocol/lode: unknown key (did you mean 'load'?); expected one of "
                      "load, duration"));
}

TEST_CASE("one table says what protocols need, for scenes and for what sets the open numbers") {
  const DocumentPlace place{"f.json"};
  const auto parsed = [&](const std::string& text, Openness openness) {
    return parse_protocol_block(parse_json(text, "f.json"), place, openness);
  };
  ProtocolBlock open = parsed(R"({"kind": "ramp_hold", "hold": "2 s"})", Openness::open);
  CHECK_FALSE(open.depth_m);
  CHECK_THAT(refusal_of([&] { (void)open.protocol(place); }),
             Contains("key /depth: is missing; expected a depth for 'ramp_hold'"));
  *open.find("depth") = 4e-3;
  *open.find("rate") = 2e-3;
  CHECK(open.find("load") == nullptr);
  const Protocol set = open.protocol(place);
  const Protocol whole =
      parsed(R"({"kind": "ramp_hold", "depth": "4 mm", "rate": "2 mm/s", "hold": "2 s"})",
             Openness::complete)
          .protocol(place);
  REQUIRE(set.knots().size() == whole.knots().size());
  for (std::size_t i = 0; i < whole.knots().size(); ++i) {
    CHECK(set.knots()[i].time_s == whole.knots()[i].time_s);
    CHECK(set.knots()[i].value == whole.knots()[i].value);
  }
  CHECK_THAT(
      refusal_of([&] { (void)parsed(R"({"kind": "creep", "load": "1 N"})", Openness::complete); }),
      Contains(
          "key /duration: is missing; expected how long the load is kept: a text of a number"));
  CHECK_THAT(
      refusal_of([&] { (void)parsed(R"({"kind": "creep", "depth": "1 mm"})", Openness::open); }),
      Contains("is no key of the kind 'creep'; expected one of load, duration"));
  const ProtocolBlock endless =
      parsed(R"({"kind": "step_hold", "depth": "4 mm", "hold": "1e200 s"})", Openness::complete);
  CHECK_THAT(refusal_of([&] { (void)endless.protocol({"f.json: key /protocol"}); }),
             Contains("f.json: key /protocol: ") && Contains("expected times within 1e15 s"));
}
