// The answer of tpm validate on a screen, requirements, and the verdict on several recordings.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "quiet_recordings.hpp"
#include "refusal.hpp"
#include "tpm/fit/validate/brief_text.hpp"

namespace tpm::fit {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;
using test::creep_recording;
using test::quiet_law;
using test::quiet_recording;
using test::request_for;

TEST_CASE("a rest within the tissue is not called no rest", "[validate]") {
  Validation v = validate(request_for(quiet_law(), quiet_recording(1.0)));
  ValidationPlacement& placement = v.recordings.front().placement;
  REQUIRE(placement.zero_readings > 0);
  CHECK_FALSE(placement.rest_in_contact);
  placement.zero_readings = 0;
  placement.zero_known = false;
  const auto in_one_line = [&v] {
    std::string text;
    for (const char c : to_terminal_text(v)) {
      const bool blank = c == ' ' || c == '\n';
      if (!blank || !text.ends_with(' ')) text += blank ? ' ' : c;
    }
    return text;
  };
  CHECK_THAT(in_one_line(), Contains("nothing before contact tells the zero"));
  placement.rest_in_contact = true;
  CHECK_THAT(in_one_line(), Contains("contact lies above the surface at rest") &&
                                !Contains("nothing before contact"));
}

// Files written and the next command follow on two more lines.
TEST_CASE("the text takes 23 lines at most and ends in the verdict", "[validate]") {
  const LawFile law = quiet_law();
  const auto lines_of = [](const Validation& v) {
    const std::string text = to_terminal_text(v);
    INFO(text);
    CHECK(text.ends_with("\n"));
    // The verdict is the last item, of three lines at most.
    const auto verdict = text.rfind("\nverdict        ");
    REQUIRE(verdict != std::string::npos);
    CHECK(std::count(text.begin() + static_cast<std::ptrdiff_t>(verdict), text.end(), '\n') <= 4);
    const auto lines = std::count(text.begin(), text.end(), '\n');
    CHECK(lines <= 23);
    CHECK((to_json(v)["recordings"].size() == v.recordings.size()));
    return lines;
  };
  SECTION("creep with five undetermined quantities") {
    PreparedRecording creep = creep_recording(law, 1.0, 5);
    // No reading before the load tells the depth without one.
    Recording& r = creep.recording;
    const std::ptrdiff_t rest = 80;
    r.time_s.erase(r.time_s.begin(), r.time_s.begin() + rest);
    r.drive.erase(r.drive.begin(), r.drive.begin() + rest);
    r.response.erase(r.response.begin(), r.response.begin() + rest);
    r.drive.front() = 0.01;
    ValidationRequest request = request_for(law, creep);
    request.requirement = parse_requirement("0.000001%", "test");
    for (int i = 0; i < 8; ++i) {
      request.remarks.push_back({"said", "something that is to be said with it"});
    }
    const Validation v = validate(request);
    CHECK(v.recordings.front().quantities.size() == 5);
    CHECK(std::ranges::all_of(v.recordings.front().quantities, [](const QuantityComparison& q) {
      return q.verdict == ModelVerdict::undetermined || !q.remark;
    }));
    (void)lines_of(v);
  }
  SECTION("thirty quantities, each with a remark of its own") {
    ValidationRequest request = request_for(law, quiet_recording(1.0));
    for (int i = 0; i < 30; ++i) {
      request.quantities.push_back({QuantityKind::at_time, 20.5 + 0.5 * i});
    }
    request.requirement = parse_requirement("0.1%", "test");
    const Validation v = validate(request);
    CHECK(lines_of(v) == 23);
    CHECK_THAT(to_terminal_text(v), Contains("left out") && Contains("quantities ("));
  }
  SECTION("forty recordings with long names") {
    ValidationRequest request = request_for(law, quiet_recording(1.0, 1));
    for (std::uint64_t i = 2; i <= 40; ++i) {
      request.recordings.push_back(quiet_recording(1.0, i));
      request.recordings.back().name = std::string(60, 'a') + std::to_string(i);
    }
    const Validation v = validate(request);
    CHECK(lines_of(v) >= 22);
    CHECK_THAT(to_terminal_text(v), Contains("recordings (") && !Contains("aaa9"));
  }
  SECTION("an ordinary answer is printed whole") {
    const Validation v = validate(request_for(law, quiet_recording(1.05)));
    CHECK(lines_of(v) < 23);
    CHECK_THAT(to_terminal_text(v), !Contains("left out"));
  }
}

TEST_CASE("a requirement in the unit of nothing is refused, also of fitted data", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  request.requirement = parse_requirement("20 mm", "--require");
  const auto refused = [&request] { (void)validate(request); };
  CHECK_THAT(test::refusal_of(refused), Contains("the unit of no quantity") && Contains("in N"));
  request.recordings.front().recording.header.sha256 = "abc";
  request.calibration.files.push_back({"fitted.csv", "abc", std::nullopt, ""});
  CHECK_THAT(test::refusal_of(refused), Contains("the unit of no quantity"));
}

TEST_CASE("what a hand can tell is asked of forces alone", "[validate]") {
  ValidationRequest request = request_for(quiet_law(), quiet_recording(1.02));
  request.requirement = parse_requirement("jnd", "--require");
  const Validation v = validate(request);
  for (const QuantityComparison& q : v.recordings.front().quantities) {
    const bool force = q.unit.symbol == "N";
    CHECK(q.limit.has_value() == force);
    CHECK((q.verdict == ModelVerdict::no_requirement) == !force);
    if (force) CHECK_THAT(*q.limit, WithinRel(0.07 * q.measured, 1e-12));
  }
  CHECK(v.verdict == ModelVerdict::adequate);
  CHECK(conclusion_words(v) ==
        "adequate for jnd, 7 %; nothing is required of relaxation ratio, half time");
}

TEST_CASE("an adequate law outside its calibration is stated with that condition", "[validate]") {
  Validation v;
  v.verdict = ModelVerdict::adequate;
  v.requirement = "5%";
  v.applicability.resize(2);
  CHECK(conclusion_words(v) == "adequate for 5%");
  v.applicability[1].outside = {{"rate", "ramp of 2 mm/s, 2 times the fastest of the calibration"}};
  CHECK(conclusion_words(v) == "adequate for 5%; outside the calibration");
}

TEST_CASE("a verdict on several recordings counts what only one of them has", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  // The first one ends with its ramp: it has no hold to differ in.
  Recording ramp = quiet_recording(1.0, 6).recording;
  const auto corner = std::ranges::max_element(ramp.drive) - ramp.drive.begin();
  for (auto* column : {&ramp.time_s, &ramp.drive, &ramp.response}) {
    column->resize(static_cast<std::size_t>(corner) + 1);
  }
  request.recordings.insert(request.recordings.begin(), prepare_recording("ramp", ramp));
  request.requirement = parse_requirement("5%", "test");
  request.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  const Validation right = validate(request);
  INFO(to_terminal_text(right));
  CHECK(right.pooled.size() == 1);
  REQUIRE(right.alone.size() == 1);
  CHECK(right.verdict == ModelVerdict::adequate);
  // The hold of the other sinks by a fifth in its course, its peak does not.
  Recording& sunk = request.recordings.back().recording;
  const auto peak =
      static_cast<std::size_t>(std::ranges::max_element(sunk.response) - sunk.response.begin());
  const auto rest = static_cast<double>(sunk.response.size() - peak);
  for (std::size_t i = peak; i < sunk.response.size(); ++i) {
    sunk.response[i] *= 1.0 - 0.2 * static_cast<double>(i - peak) / rest;
  }
  const Validation wrong = validate(request);
  INFO(to_terminal_text(wrong));
  CHECK(wrong.verdict == ModelVerdict::not_adequate);
  CHECK_THAT(conclusion_words(wrong), Contains("force at end of hold"));
  CHECK(to_json(wrong).at("in_one_only").size() == 1);
}

TEST_CASE("an amount that is required counts where protocols differ, too", "[validate]") {
  const auto deep = [](double depth_mm, double stiffer, std::uint64_t seed) {
    Random random(seed);
    test::StudyNoise noise;
    noise.sigma_N = 2e-4;
    test::StudyTest made = test::study_validation(200, 0.0);
    made.depth_mm = depth_mm;
    PreparedRecording r =
        prepare_recording("deep", test::study_recording(made, noise, random, stiffer));
    r.name = fmt::format("{} mm", depth_mm);
    return r;
  };
  const auto validated = [&](const char* requirement, double stiffer) {
    ValidationRequest request = request_for(quiet_law(), deep(1.0, stiffer, 1));
    request.recordings.push_back(deep(3.0, stiffer, 2));
    request.recordings.push_back(deep(2.0, stiffer, 3));
    request.requirement = parse_requirement(requirement, "test");
    return validate(request);
  };
  const Validation right = validated("20 mN", 1.0);
  INFO(to_terminal_text(right));
  CHECK(right.verdict == ModelVerdict::adequate);
  CHECK(right.answers_yes());
  const PooledQuantity& peak = right.pooled.front();
  REQUIRE(peak.relative);
  CHECK(peak.limit_at == "3 mm");
  const QuantityComparison& deepest = test::study_quantity(right.recordings[1], QuantityKind::peak);
  CHECK_THAT(peak.limit.value(), WithinRel(0.02 / deepest.simulated, 1e-12));
  CHECK(to_json(right).at("pooled")[0].at("R_at") == "3 mm");
  CHECK_THAT(to_terminal_text(right), Contains("R is 20 mN at 3 mm"));
  const Validation wrong = validated("20 mN", 1.25);
  INFO(to_terminal_text(wrong));
  CHECK(wrong.verdict == ModelVerdict::not_adequate);
  CHECK_THAT(conclusion_words(wrong), Contains("not adequate for 20 mN"));
  // A hand tells forces: nothing is asked of ratio and half time.
  for (const PooledQuantity& p : validated("jnd", 1.0).pooled) {
    CHECK(p.limit.has_value() == (p.unit.symbol == "N"));
  }
  CHECK(validated("jnd", 1.25).verdict == ModelVerdict::not_adequate);
}

TEST_CASE(
    "without a rest the text names what the zero leaves undetermined and the verdict on the rest",
    "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request =
      request_for(law, prepare_recording("cut", test::study_recording_without_rest()));
  request.requirement = parse_requirement("10%", "test");
  const Validation v = validate(request);
  const std::string text = to_terminal_text(v);
  INFO(text);
  CHECK_THAT(text, Contains("undetermined   peak force, force at end of hold, relaxation ratio: "
                            "depends on the zero of the force") &&
                       Contains("half time, s"));
  CHECK_THAT(v.recordings.front().placement.contact_words, Contains("onset"));
  for (const QuantityComparison& q : v.recordings.front().quantities) {
    const bool by_zero = q.quantity.kind != QuantityKind::half_time;
    CHECK(q.unknown == by_zero);
    CHECK((q.verdict == ModelVerdict::undetermined) == by_zero);
  }
  CHECK_THAT(conclusion_words(v), Contains("undetermined for 10%: peak force"));
}

TEST_CASE("a table of which no row is printed has no head", "[validate]") {
  BriefText text;
  text.add_table("recording  E\n------------\na  1\nb  2\n", BriefText::Rank::recording,
                 "recordings");
  for (int i = 0; i < 19; ++i) text.add_line("note", std::to_string(i), BriefText::Rank::remark);
  text.add_line("detail", "words", BriefText::Rank::detail);
  text.add_line("verdict", "none", BriefText::Rank::always);
  const std::string printed = text.text();
  INFO(printed);
  CHECK_THAT(printed, !Contains("------------") && !Contains("recording  E"));
  CHECK_THAT(printed, Contains("left out") && Contains("recordings (2)"));
  CHECK_THAT(printed, Contains("words"));  // there is room for it without the head
  CHECK(std::count(printed.begin(), printed.end(), '\n') == 22);
}

}  // namespace tpm::fit
