// Sessions: what a file leads to, bad files, verification and its honesty, boundaries of rendering.
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "hil_scenes.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/haptics/session/recording_export.hpp"
#include "tpm/haptics/session/rendering_boundary.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/session/surface_scene.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::parsed;
using test::short_session;
using test::with;

TEST_CASE("A session's phases follow each other as its file says") {
  const HilSession session = parsed(short_session());
  std::vector<std::string> names;
  for (const SessionPhase& phase : session.phases) names.push_back(phase.name);
  CHECK(names == std::vector<std::string>{"approach", "indent to 4 mm at 4 mm/s",
                                          "hold 4 mm after 4 mm/s", "release from 4 mm at 4 mm/s",
                                          "rest", "approach", "load to 0.2 N", "creep under 0.2 N",
                                          "rest"});
  CHECK_THAT(session.duration_s(), WithinAbs(1 + 1 + 2 + 1.5 + 1 + 1 + 1 + 1 + 1, 1e-12));
}

TEST_CASE("Bad sessions: one line each, with the key") {
  struct Case {
    const char* pointer;
    Json value;
    const char* message;
  };
  const Case bad = GENERATE(
      Case{"/rate", "5 kHz", "key /rate: 5000 Hz; expected 500 to 4000 Hz"},
      Case{"/rate", "1 kg", "key /rate"}, Case{"/limits/force", "20 N", "key /limits/force: 20 N"},
      Case{"/limits/watchdog", "32 ms", "expected 0.004 to 0.016 s"},
      Case{"/push", Json::array({0, 0, 0}), "key /push: has no length"},
      Case{"/indentations/depths", Json::array({"0 mm"}), "key /indentations/depths/0"},
      Case{"/indentations/hold", "13 h", "takes 4.681e+04 s; expected 12 hours"},
      Case{"/model/kind", "magic", "/model/kind"},
      Case{"/model/kind", "zone",
           "key /model/kind: unknown word 'zone'; expected one of planned, linear, "},
      Case{"/model/tolerance", "1%", "none but with the kind 'planned'"},
      Case{"/model", Json{{"tolerance", "70%"}, {"scene", Json::object()}},
           "key /model/tolerance: '70%'; expected a share of the peak"},
      Case{"/model/tool_radius", "10 mm", "none but with the kind 'surface'"},
      Case{"/slides", Json{{"depths", {"4 mm"}}, {"distance", "20 mm"}, {"rate", "10 mm/s"}},
           "key /slides: the model does not follow a tool across its push"},
      Case{"/phase", 1, "phase"});
  CAPTURE(bad.pointer, bad.value.dump());
  CHECK_THROWS_WITH(parsed(with(short_session(), bad.pointer, bad.value)), Contains(bad.message));
}

TEST_CASE("The element refuses a scene that is no star") {
  const HilSession session = parsed(
      with(short_session(), "/model/scene",
           Json{{"organ", {{"kind", "block"}, {"cells", {2, 2, 2}}, {"spacing", "20 mm"}}}}));
  CHECK_THROWS_AS(make_loop_model(session), Error);
}

HilRecording recorded(const test::TempFolder& folder, const Json& json = short_session()) {
  SessionRunOptions options;
  options.recording = folder / "r";
  (void)run_session(parsed(json), {}, options);
  return read_recording(folder / "r");
}

/// A short push on a small liver, by a patch.
Json patch_session(const std::string& kind) {
  const std::filesystem::path configs = std::filesystem::path(TPM_TEST_SOURCE_DIR) / "configs";
  Json json = read_json(configs / "hil_planned.json");
  json["model"]["kind"] = kind;
  if (kind != "planned") json["model"].erase("tolerance");
  json["model"]["scene"]["organ"] = {{"kind", "liver"}, {"count", 80}};
  json["model"]["contact"] = {{"kind", "patch"}, {"radius", "40 mm"}};
  json["indentations"] = {
      {"depths", {"3 mm"}}, {"rates", {"8 mm/s"}}, {"hold", "0.5 s"}, {"rest", "0.5 s"}};
  return json;
}

TEST_CASE("A patch is pushed by models that move several spheres, and verified", "[heavy]") {
  const test::TempFolder folder;
  for (const char* const kind : {"curves", "planned"}) {
    const HilRecording recording = recorded(folder, patch_session(kind));
    const Verification v = verify(recording);
    CAPTURE(kind, v.all.max_N / v.all.peak_N);
    CHECK(v.whole);
    CHECK(v.all.max_N < test::allowed_error("session.patch_models") * v.all.peak_N);
    CHECK(v.others.front().apart_N <
          test::allowed_error("session.patch_references_apart") * v.all.peak_N);
    std::filesystem::remove_all(folder / "r");
  }
  Json one = patch_session("curves");
  one["model"].erase("contact");
  const double by_patch = make_loop_model(parsed(patch_session("curves"))).stiffness_N_per_m;
  CHECK(by_patch > 1.5 * make_loop_model(parsed(one)).stiffness_N_per_m);
}

TEST_CASE("A patch is refused by models of one sphere, and a contact where there is none",
          "[heavy]") {
  for (const char* const kind : {"condensed", "network"}) {
    CHECK_THROWS_WITH(make_loop_model(parsed(patch_session(kind))),
                      Contains("/model/contact") && Contains("pushed at one sphere"));
  }
  CHECK_THROWS_WITH(parsed(patch_session("surface")),
                    Contains("/model/contact") && Contains("is not for the kind 'surface'"));
  CHECK_THROWS_WITH(
      make_loop_model(parsed(with(patch_session("curves"), "/model/contact/radius", "1 m"))),
      Contains("radius"));
}

TEST_CASE("What else presses on the tissue of a session is refused, whatever its model") {
  for (const char* const kind :
       {"condensed", "network", "curves", "linear", "planned", "surface"}) {
    CAPTURE(kind);
    Json session = patch_session(kind);
    session["model"].erase("contact");
    const Json two = {{{"kind", "sphere"}}, {{"kind", "sphere"}, {"number", 5}}};
    CHECK_THROWS_WITH(parsed(with(session, "/model/scene/contacts", two)),
                      Contains("/model/scene/contacts: the hand is the only contact"));
    const Json weight = {{{"kind", "gravity"}, {"direction", {0, -1, 0}}}};
    CHECK_THROWS_WITH(parsed(with(session, "/model/scene/loads", weight)),
                      Contains("/model/scene/loads: a session starts from the tissue without"));
  }
}

TEST_CASE("A session of the element verifies against the network, the closed form and CVODES") {
  const test::TempFolder folder;
  const HilRecording recording = recorded(folder);
  const Verification v = verify(recording);
  CHECK(v.whole);
  CHECK(v.all.peak_N > 0.4);
  CHECK(v.all.max_N < test::allowed_error("session.element") * v.all.peak_N);
  REQUIRE(v.others.size() == 3);
  // By CVODE on the network, CVODES on the element and in closed form: one and the same force.
  CHECK(v.others[0].apart_N <
        test::allowed_error("session.element_references_apart") * v.all.peak_N);
  CHECK(v.others[2].apart_N <
        test::allowed_error("session.element_references_apart") * v.all.peak_N);
  // At every sample and undecimated: what is left comes from letting go within a period, at most
  // the force of one encoder step.
  constexpr double kStep_N = 150.72 * 1e-5;
  CHECK(v.others[1].commanded.max_N < kStep_N);
  CHECK(v.others[1].commanded.rms_N < 0.05 * kStep_N);
  CHECK(v.others[2].commanded.max_N < 0.005 * v.all.peak_N);
  CHECK(v.phases.size() == recording.session.phases.size());
}

/// How deep the operator of a session means to be under where the ball would touch the organ at
/// rest, while sliding: least and most. Found by halving, sphere by sphere.
std::pair<double, double> depths_while_sliding(const HilSession& session) {
  const SurfaceScene surface(session);
  const Positions& rest = surface.scene.rest();
  const Eigen::Vector3d into = surface.scene.probe().direction;
  OperatorScript script = session.operator_script();
  std::pair<double, double> depths{1.0, -1.0};
  const double from_s = session.phases[1].end_s, to_s = session.phases[3].end_s;
  for (int i = 0; i <= 50; ++i) {
    const OperatorAim aim = script.at(from_s + i * (to_s - from_s) / 50);
    const Eigen::Vector3d aside = surface.to_model * aim.across_m;
    double out = -0.03, in = 0.03;
    for (int halvings = 0; halvings < 20; ++halvings) {
      const double middle = 0.5 * (out + in);
      const Eigen::Vector3d ball = surface.ball.start_m + aside + middle * into;
      const double nearest = (rest.colwise() - ball).colwise().norm().minCoeff();
      (nearest < surface.ball.reach_m() ? in : out) = middle;
    }
    depths.first = std::min(depths.first, aim.value - in);
    depths.second = std::max(depths.second, aim.value - in);
  }
  return depths;
}

TEST_CASE("A slide follows the surface of the organ", "[heavy]") {
  HilSession session = parsed(test::slide_session());
  const auto [straight_least, straight_most] = depths_while_sliding(session);
  follow_surface(session);
  const auto [least, most] = depths_while_sliding(session);
  CAPTURE(straight_least, straight_most, least, most);
  CHECK(most - least < 0.25 * (straight_most - straight_least));
  CHECK(least > 3.3e-3);
  CHECK(most < 4.2e-3);
  const std::vector<double>& there = session.phases[2].surface_m;
  const std::vector<double>& back = session.phases[3].surface_m;
  REQUIRE(there.size() > 20);
  CHECK(there.front() == 0.0);
  REQUIRE(back.size() == there.size());
  for (std::size_t i = 0; i < there.size(); ++i) {
    CHECK_THAT(back[back.size() - 1 - i], WithinAbs(there[i], 1e-12));
  }
  // Nothing else has changed, and nothing jumps.
  CHECK(session.phases[1].surface_m.empty());
  const auto pieces = session.operator_script().pieces();
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    CHECK(pieces[i].from == pieces[i - 1].to);
    CHECK(pieces[i].across_from_m == pieces[i - 1].across_to_m);
  }
  HilSession other = parsed(short_session());
  follow_surface(other);
  CHECK(other.phases.front().surface_m.empty());
}

TEST_CASE("A session over the surface verifies in all three components", "[heavy]") {
  const Json json = test::slide_session();
  HilSession session = parsed(json);
  follow_surface(session);
  CHECK(session.slide == Eigen::Vector3d::UnitY());
  std::vector<std::string> names;
  for (const SessionPhase& phase : session.phases) names.push_back(phase.name);
  CHECK(names == std::vector<std::string>{"approach", "press to 4 mm at 10 mm/s",
                                          "slide 20 mm at 20 mm/s, 4 mm deep",
                                          "slide back 20 mm at 20 mm/s, 4 mm deep",
                                          "release from 4 mm at 10 mm/s", "rest"});
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "a.tpmrec";
  const SessionRun run = run_session(session, {}, options);
  CHECK(run.outcome.cause == StopCause::finished);
  CHECK(run.outcome.counts.beyond_model == 0);
  HilRecording recording = read_recording(options.recording);
  CHECK(recording.session.phases[2].surface_m == session.phases[2].surface_m);
  const VerifyOptions coarse{.spacing_s = 0.05};
  const Verification v = verify(recording, coarse);
  CHECK(v.phases.size() == 6);
  CHECK(v.all.peak_N > 0.1);
  for (const PhaseFidelity& phase : v.phases) {
    CAPTURE(phase.phase.name);
    CHECK(phase.force.max_N < test::allowed_error("session.surface") * v.all.peak_N);
  }
  CHECK(v.reference_error_N < test::allowed_error("session.surface_reference") * v.all.peak_N);
  // CVODE, from the first touch to the end: as far from the reference as that is from the exact
  // answer.
  REQUIRE(v.others.size() == 1);
  CHECK(v.others[0].start_s > 0.5);
  CHECK(v.others[0].start_s < 1.5);
  CHECK(v.others[0].end_s > v.phases.back().start_s);
  CHECK(v.others[0].apart_N < 2.5 * v.reference_error_N);
  CHECK(v.others[0].apart_N > 0.0);
  // The hand was pushed aside, across the push, and a force that is wrong there is found.
  double aside_N = 0.0;
  for (ServoRecord& row : recording.rows) {
    aside_N = std::max(aside_N, std::hypot(row.commanded_N[0], row.commanded_N[1]));
    if (row.phase == 2) row.commanded_N[0] += 0.01 * v.all.peak_N;
  }
  CHECK(aside_N > 0.1 * v.all.peak_N);
  const Verification wrong = verify(recording, {.spacing_s = 0.05, .window_s = 0.0});
  CHECK(wrong.phases[2].force.max_N > 0.0095 * v.all.peak_N);
  CHECK(wrong.phases[1].force.max_N == v.phases[1].force.max_N);

  CHECK_THROWS_WITH(parsed(with(json, "/slides/direction", Json::array({0, 0, 2}))),
                    Contains("key /slides/direction: has no part across the push"));
}

TEST_CASE("Verification finds a force that is wrong by one percent of the peak in one phase") {
  const test::TempFolder folder;
  HilRecording recording = recorded(folder);
  const Verification before = verify(recording);
  for (ServoRecord& row : recording.rows) {
    if (row.phase == 2) row.commanded_N[2] += 0.01 * before.all.peak_N;
  }
  const Verification v = verify(recording);
  CHECK(v.phases[2].force.max_N > 0.009 * v.all.peak_N);
  CHECK(v.phases[1].force.max_N < 0.005 * v.all.peak_N);
}

TEST_CASE("What makes a session differ from a reading is named") {
  struct Case {
    double measured_N, commanded_N, reference_N, reached_m;
    std::uint32_t flags;
    std::vector<std::string> words, not_words;
  };
  const Case cases[] = {
      // The tissue of the scene, which the full network shows as well.
      {2.0,
       0.5,
       0.501,
       8e-3,
       kTouching,
       {"no limit acted", "answers 0.501 N", "(E1 12 kPa) are 4 times softer"},
       {"pushed to"}},
      {1.0, 2.0, 2.0, 8e-3, 0, {"no limit acted", "2 times stiffer"}, {"of it"}},
      // The session's limit: the network reaches the reading.
      {2.0,
       0.5,
       2.0,
       8e-3,
       kForceLimited,
       {"1.5 N of it is the loop's, where limits acted: the session's force limit"},
       {"softer"}},
      {2.0,
       0.5,
       1.0,
       4e-3,
       kSaturated | kSlipping,
       {"pushed to 4 mm of 8 mm", "the motors' force, the allowed rise", "2 times softer"},
       {}},
      // The model in the loop.
      {2.0,
       1.5,
       2.0,
       8e-3,
       0,
       {"0.5 N of it is the error of the model in the loop; no limit acted"},
       {"softer"}},
      {2.0, 2.01, 2.01, 8e-3, 0, {"the reading is met"}, {"limit"}}};
  for (const Case& c : cases) {
    BesideExperiment e;
    e.depth_m = 8e-3;
    e.measured_N = c.measured_N;
    e.commanded_N = c.commanded_N;
    e.reference_N = c.reference_N;
    e.reached_m = c.reached_m;
    e.flags = c.flags;
    const std::string cause = cause_of_difference(e, "E1 12 kPa");
    for (const std::string& words : c.words) CHECK_THAT(cause, Contains(words));
    for (const std::string& words : c.not_words) CHECK_THAT(cause, !Contains(words));
  }
}

TEST_CASE("A thinned motion stays within its tolerance, and keeps its ends") {
  std::vector<double> time, value;
  for (int i = 0; i < 5000; ++i) {
    time.push_back(1e-3 * i);
    value.push_back(std::round(1e5 * 4e-3 * std::sin(3e-3 * i)) * 1e-5);
  }
  const std::vector<std::size_t> kept = decimated(time, value, 5e-6);
  CHECK(kept.front() == 0);
  CHECK(kept.back() == 4999);
  CHECK(kept.size() < 2500);
  for (std::size_t k = 1; k < kept.size(); ++k) {
    const std::size_t a = kept[k - 1], b = kept[k];
    for (std::size_t i = a; i <= b; ++i) {
      const double line =
          value[a] + (value[b] - value[a]) * (time[i] - time[a]) / (time[b] - time[a]);
      REQUIRE(std::abs(value[i] - line) <= 5e-6 * (1.0 + 1e-9));
    }
  }
}

TEST_CASE("Every output of a simulated device says so") {
  const test::TempFolder folder;
  const HilRecording recording = recorded(folder);
  const Verification v = verify(recording);
  CHECK_THAT(verification_text(recording, v), Contains("SIMULATED DEVICE"));
  CHECK(verification_json(recording, v).at("simulated_device") == true);
}

TEST_CASE("The errors of each kind of phase, which the text tables, are in the JSON of a session") {
  const HilRecording made = recorded(test::TempFolder());
  const files::Json json = verification_json(made, verify(made));
  std::size_t counted = 0;
  double most_N = 0.0;
  for (const files::Json& kind : json.at("kinds")) {
    counted += kind.at("count").get<std::size_t>();
    most_N = std::max(most_N, kind.at("max_N").get<double>());
  }
  CHECK(std::pair(counted, most_N) ==
        std::pair(json.at("phases").size(), json.at("all").at("max_N").get<double>()));
}

TEST_CASE("An exported recording holds every column of every row, with unit, and what made it") {
  const test::TempFolder folder;
  const HilRecording recording = recorded(folder);
  export_recording(recording, "0123", folder / "r.h5");
  const Hdf5Reader file(folder / "r.h5");
  CHECK(file.number_attribute("/", "simulated_device") == 1.0);
  CHECK(file.attribute("/header/device", "kind") == "virtual");
  CHECK(file.attribute("/header", "version") == recording.header.at("version"));
  CHECK(file.attribute("/", "version") == version());
  CHECK(file.texts("/inputs/sha256") == std::vector<std::string>{"0123"});
  CHECK(file.attribute("/", "cause") == "finished");
  CHECK(parse_json(file.texts("/header_json").at(0), "header") == recording.header);
  CHECK(parse_json(file.texts("/closing_json").at(0), "closing") == recording.closing);
  CHECK(file.texts("/phases/name").size() == recording.session.phases.size());
  CHECK(file.members("/rows").size() == 36);
  for (const std::string& name : file.members("/rows")) {
    const std::string unit = file.attribute("/rows/" + name, "unit");
    const std::string tail = name.substr(name.find_last_of('_') + 1);
    CAPTURE(name, unit);
    CHECK(unit == (tail == "s" || tail == "m" || tail == "N" || tail == "J" ? tail : "1"));
    CHECK_FALSE(file.attribute("/rows/" + name, "meaning").empty());
  }
  const auto same = [&](const char* name, const std::function<double(const ServoRecord&)>& value) {
    const std::vector<double> column = file.numbers(std::string("/rows/") + name);
    REQUIRE(column.size() == recording.rows.size());
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (column[i] != value(recording.rows[i])) FAIL(name << " of row " << i);
    }
  };
  same("position_z_m", [](const ServoRecord& row) { return row.position_m[2]; });
  same("commanded_z_N", [](const ServoRecord& row) { return row.commanded_N[2]; });
  same("commanded_N", [](const ServoRecord& row) { return row.commanded_N[2]; });  // push -z
  same("tool_depth_m", [](const ServoRecord& row) { return row.tool_depth_m; });
  same("surface_depth_m", [](const ServoRecord& row) { return row.surface_depth_m; });
  same("model_force_N", [](const ServoRecord& row) { return row.model_force_N; });
  same("observed_J", [](const ServoRecord& row) { return row.observed_J; });
  same("leak_J", [](const ServoRecord& row) { return row.leak_J; });
  same("time_s", [](const ServoRecord& row) { return 1e-3 * static_cast<double>(row.cycle); });
}

TEST_CASE("A recording that is cut off is exported as such") {
  const test::TempFolder folder;
  HilRecording recording = recorded(folder);
  recording.closed = false;
  recording.rows.resize(100);
  export_recording(recording, "", folder / "r.h5");
  const Hdf5Reader file(folder / "r.h5");
  CHECK(file.number_attribute("/", "whole") == 0.0);
  CHECK(file.attribute("/", "cause") == "cut off");
  CHECK_FALSE(file.has("/closing_json"));
  CHECK(file.numbers("/rows/time_s").size() == 100);
}

/// The exact update without delay, in closed form: (T/2) (k0 + 2 G / (1 + E)), worst at the Nyquist
/// frequency, E = exp(-T/tau), G = g (1 - E) tau / T.
double exact_update_damping(double equilibrium_N_per_m, double relaxing_N_per_m,
                            double relaxation_time_s, double period_s) {
  const double z = period_s / relaxation_time_s;
  const double gain = relaxing_N_per_m * -std::expm1(-z) / z;
  return 0.5 * period_s * (equilibrium_N_per_m + 2.0 * gain / (1.0 + std::exp(-z)));
}

TEST_CASE("The boundary of the exact update is the closed form, at every relaxation time") {
  for (const double periods : {1e-3, 0.1, 1.0, 10.0, 1e3}) {
    RenderedContact contact;
    contact.relaxation_time_s = periods * contact.period_s;
    const double half = 0.5 * contact.stiffness_N_per_m;
    CHECK_THAT(
        predicted_passive_damping(contact),
        WithinRel(exact_update_damping(half, half, contact.relaxation_time_s, contact.period_s),
                  1e-9));
  }
  // Its limits: relaxed stiffness and the relaxing spring's dashpot, or all taut.
  CHECK_THAT(exact_update_damping(100.0, 50.0, 1e-7, 1e-3),
             WithinRel(100 * 5e-4 + 50 * 1e-7, 1e-9));
  CHECK_THAT(exact_update_damping(100.0, 50.0, 1e3, 1e-3), WithinRel(150.0 * 5e-4, 1e-6));
}

TEST_CASE("The measured boundary of passivity is the predicted one") {
  for (const int delay : {0, 1, 4}) {
    for (const ElementRule rule :
         {ElementRule::exact, ElementRule::forward_euler, ElementRule::mass_spring}) {
      RenderedContact contact;
      contact.rule = rule;
      contact.delay_periods = delay;
      contact.relaxation_time_s = 2e-3;
      CAPTURE(delay, static_cast<int>(rule));
      CHECK_THAT(measured_passive_damping(contact),
                 WithinRel(predicted_passive_damping(contact), 0.05));
    }
  }
}

TEST_CASE("A spring with a delay follows Colgate and Schenkel's line") {
  RenderedContact spring;
  spring.relaxation_time_s = 1e3;  // all taut
  spring.delay_periods = 3;
  CHECK_THAT(predicted_passive_damping(spring), WithinRel(spring.stiffness_N_per_m * 3.5e-3, 0.01));
}

TEST_CASE("Forward Euler diverges below half a period, the exact update does not") {
  RenderedContact contact;
  contact.relaxation_time_s = 0.208e-3;  // the paper's
  contact.rule = ElementRule::forward_euler;
  CHECK(std::isinf(measured_passive_damping(contact)));
  CHECK(std::isinf(predicted_passive_damping(contact)));
  contact.rule = ElementRule::exact;
  CHECK(measured_passive_damping(contact) < 0.5e-3 * contact.stiffness_N_per_m);
}

TEST_CASE("Device and arm are stable up to the stiffness that the spectral radius says") {
  for (const int delay : {0, 2}) {
    RenderedContact contact;
    contact.delay_periods = delay;
    CAPTURE(delay);
    const double predicted = largest_stable_stiffness(contact, {}, BoundaryBy::prediction);
    CHECK_THAT(largest_stable_stiffness(contact, {}, BoundaryBy::measurement),
               WithinRel(predicted, 0.02));
    contact.stiffness_N_per_m = 0.9 * predicted;
    CHECK(loop_spectral_radius(contact, {}) < 1.0);
    contact.stiffness_N_per_m = 1.1 * predicted;
    CHECK(loop_spectral_radius(contact, {}) > 1.0);
  }
}

}  // namespace
}  // namespace tpm::haptics
