// The presses of a session as recordings: what was asked for, where it began, and how the law that
// was rendered answers the hand's motion.
#include <catch2/catch.hpp>
#include <cmath>

#include "hil_scenes.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/fit/validate/validation.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/verify/session_presses.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

/// Two presses on 60 + 45 exp(-t / 2 s) N/m, the second before the first is forgotten.
Json two_presses(const char* rate = "2 mm/s") {
  Json json = Json::parse(R"({
    "model": {"kind": "law", "law": {"law": "linear-1", "drive": "indentation_depth",
      "response": "contact_force", "reference_m": 0.004, "fitted_to_m": 0.004,
      "parameters": {"k_inf_N_per_m": 60, "k1_N_per_m": 45, "tau1_s": 2}, "provenance": "assumed"}},
    "indentations": {"depths": ["2 mm", "3 mm"], "rates": [], "hold": "3 s", "rest": "1 s"}
  })");
  json["indentations"]["rates"].push_back(rate);
  return json;
}

HilRecording law_recording(const test::TempFolder& folder, const char* rate = "2 mm/s") {
  SessionRunOptions options;
  options.recording = folder / "r";
  (void)run_session(test::parsed(two_presses(rate)), {}, options);
  return read_recording(folder / "r");
}

LawFile rendered_law(double stiffer) {
  LawFile law;
  law.spec = parse_law_name("linear-1", "test");
  law.spec.reference = 4e-3;
  law.values = {60.0 * stiffer, 45.0 * stiffer, 2.0, 0.0, 0.0};
  law.fitted_to = 4e-3;
  LawUncertainty u;
  u.place = {0, 1, 2};
  u.coordinate = {Coordinate::linear, Coordinate::linear, Coordinate::log};
  u.covariance = Eigen::Vector3d(0.01, 0.01, 1e-4).asDiagonal();
  law.uncertainty = u;
  return law;
}

}  // namespace

TEST_CASE("A session's presses are those that it asked for, each with what came before") {
  const test::TempFolder folder;
  const SessionPresses found = session_presses(law_recording(folder), "abc");
  CHECK(found.left_out.empty());
  const std::vector<SessionPress>& presses = found.made;
  REQUIRE(presses.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const Recording& r = presses[i].recording.recording;
    CHECK(r.header.sha256 == "abc");
    CHECK(r.header.id == presses[i].motion.session + ": " + presses[i].motion.press);
    CHECK(r.time_s.size() >= 2000);
    const std::vector<Knot>& knots = presses[i].motion.knots;
    CHECK(knots.front().time_s == 0.0);
    CHECK(knots.back().time_s >= r.time_s.back());
    CHECK(knots.back().time_s < r.time_s.back() + 0.01);
    CHECK_THAT(r.time_s.back() - presses[i].motion.hold_asked_s.value(), WithinAbs(3.0, 0.01));
    const double deepest = *std::ranges::max_element(r.drive);
    CHECK_THAT(deepest, WithinAbs(i == 0 ? 2e-3 : 3e-3, 2e-4));
  }
  CHECK(presses[1].motion.knots.size() > presses[0].motion.knots.size());
}

TEST_CASE("The law that was rendered answers the hand's motion, and a stiffer one does not") {
  const test::TempFolder folder;
  // The slower hand pauses where it meets the surface.
  const char* rate = GENERATE("2 mm/s", "1 mm/s");
  CAPTURE(rate);
  const std::vector<SessionPress> presses =
      session_presses(law_recording(folder, rate), "abc").made;
  const auto compared = [&](double stiffer) {
    fit::ValidationRequest request;
    request.law = rendered_law(stiffer);
    request.law_file = "law.json";
    request.quantities = {{fit::QuantityKind::peak}, {fit::QuantityKind::end_of_hold}};
    request.requirement = fit::parse_requirement("2%", "test");
    for (const SessionPress& press : presses) {
      request.recordings.push_back(press.recording);
      request.presses.push_back(press.motion);
    }
    return fit::validate(request);
  };
  const fit::Validation same = compared(1.0);
  INFO(to_terminal_text(same));
  for (const fit::RecordingComparison& r : same.recordings) {
    for (const fit::QuantityComparison& q : r.quantities) {
      // S follows every row of the hand's motion: over those alone that are compared it differs by
      // 4e-5.
      CHECK(std::abs(q.e.error) < 2e-5 * q.measured);
    }
    CHECK(r.part.whole());
  }
  CHECK(same.verdict == fit::ModelVerdict::adequate);
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const double largest = *std::ranges::max_element(presses[i].recording.recording.response);
    CHECK_THAT(same.recordings[i].quantities.front().measured, WithinRel(largest, 0.05));
  }
  for (const fit::RenderingError& e : rendering_errors(same)) {
    CHECK(e.presses == 2);
    CHECK(std::abs(e.mean) < 2e-5);
    CHECK(e.limit < 2e-5);
  }
  CHECK(compared(1.1).verdict == fit::ModelVerdict::not_adequate);
}

}  // namespace tpm::haptics
