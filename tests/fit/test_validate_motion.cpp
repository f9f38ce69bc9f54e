// What a recording does not show: when the drive changed between two samples, and a force beyond
// the limit of its cell.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "quiet_recordings.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/select/clipping.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::quiet_law;
using test::request_for;

constexpr double kJumpDepth = 3e-3, kJumpEvery_s = 0.1, kJumpFrom_s = 4.0;
constexpr const char* kChangePart = "the time of a change between two samples";

/// The study's material, 60 + 45 exp(-t / 2 s) N/m, after a jump to 3 mm that comes later than the
/// middle between the samples at 4.0 and 4.1 s.
Recording jump(double later_s, double sigma_N, Random& random) {
  Recording r;
  r.header.id = "jump";
  const double jump_s = kJumpFrom_s + 0.5 * kJumpEvery_s + later_s;
  for (int i = 0; i < 240; ++i) {
    const double t = kJumpEvery_s * i;
    const bool pressed = i > 40;
    r.time_s.push_back(t);
    r.drive.push_back(pressed ? kJumpDepth : 0.0);
    const double force = pressed ? kJumpDepth * (60.0 + 45.0 * std::exp(-(t - jump_s) / 2.0)) : 0.0;
    r.response.push_back(force + sigma_N * random.normal());
  }
  return r;
}

const QuantityComparison& of_kind(const RecordingComparison& r, QuantityKind kind) {
  const auto found = std::ranges::find_if(
      r.quantities, [kind](const QuantityComparison& q) { return q.quantity.kind == kind; });
  REQUIRE(found != r.quantities.end());
  return *found;
}

double u_of(const QuantityComparison& q, const std::string& name) {
  const auto found = std::ranges::find(q.parts, name, &UncertaintyPart::name);
  return found == q.parts.end() ? 0.0 : found->u;
}

}  // namespace

TEST_CASE("when the drive jumped between two samples is in u_D", "[validate]") {
  Random random(2);
  const LawFile law = quiet_law();
  // Anywhere between the samples: a rectangle. The branch has relaxed for so much longer or less.
  const double u_s = kJumpEvery_s / std::sqrt(12.0);
  for (const double later_s : {-0.045, 0.0, 0.045}) {
    CAPTURE(later_s);
    const Validation v =
        validate(request_for(law, prepare_recording("jump", jump(later_s, 1e-4, random))));
    const QuantityComparison& peak = of_kind(v.recordings.front(), QuantityKind::peak);
    CAPTURE(to_terminal_text(v));
    const double slope = kJumpDepth * 45.0 / 2.0 * std::exp(-0.025);  // of the peak, N/s
    CHECK_THAT(u_of(peak, kChangePart), WithinRel(slope * u_s, 0.03));
    CHECK_THAT(peak.e.error, WithinAbs(-slope * later_s, 3.0 * 2e-4));
    CHECK(std::abs(peak.e.error) <= peak.e.expanded());  // the law is right
    CHECK(v.verdict == ModelVerdict::not_seen);
    CHECK(v.recordings.front().joint.p_value > 1e-3);
    const QuantityComparison& end = of_kind(v.recordings.front(), QuantityKind::end_of_hold);
    CHECK(u_of(end, kChangePart) < 1e-3 * u_of(peak, kChangePart));  // it has forgotten
    CHECK_THAT(to_terminal_text(v), Contains("between the samples at 4 and 4.1 s is not known"));
    CHECK(to_json(v).at("recordings").at(0).at("unseen_rises").size() == 1);
  }
}

TEST_CASE("a ramp that the samples show has no such part", "[validate]") {
  const Validation v = validate(request_for(quiet_law(), test::quiet_recording(1.0)));
  CHECK(v.recordings.front().rises.empty());
  for (const QuantityComparison& q : v.recordings.front().quantities)
    CHECK(u_of(q, kChangePart) == 0.0);
}

TEST_CASE("u_input counts that the calibration's own jump is not known", "[validate]") {
  Random random(7);
  const double later_s = 0.03;
  const PreparedRecording fitted = prepare_recording("jump", jump(later_s, 1e-4, random));
  SetupOptions setup;
  setup.profiles = false;
  setup.reference = kJumpDepth;
  setup.starts = 2;
  const std::vector<PreparedRecording> data{fitted};
  LawFile law =
      fitted_law(run_fit(recording_config(test::study_law(), data, setup), data_sets(data)));
  REQUIRE(law.uncertainty);
  REQUIRE(law.uncertainty->data.size() == 1);
  REQUIRE(law.uncertainty->data.front().rises.size() == 1);
  const LawFile with = with_calibration_covariance(law, data).value();
  // The stiffness of the branch and the delay trade off: k1 exp(delay / tau1) is what is measured.
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  const auto& place = with.uncertainty->place;
  const auto of_k1 =
      std::ranges::find_if(place, [&](std::size_t p) { return parameters[p].name == "k1"; });
  REQUIRE(of_k1 != place.end());
  const auto k = static_cast<Eigen::Index>(of_k1 - place.begin());
  const double u_k1 = coordinate_slope(with.uncertainty->coordinate.at(static_cast<std::size_t>(k)),
                                       with.values.at(*of_k1)) *
                      std::sqrt(with.uncertainty->covariance(k, k));
  const double by_delay = 45.0 / 2.0 * 0.5 * kJumpEvery_s;
  CHECK(u_k1 > 0.8 * by_delay);
  CHECK(u_k1 < 1.5 * by_delay);
}

TEST_CASE("a quantity that is read from clipped readings is undetermined", "[validate]") {
  Random random(9);
  const LawFile law = quiet_law();
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  noise.zero_N = 0.0;
  Recording r = test::study_recording(test::study_validation(200, 0.0), noise, random);
  for (double& force : r.response) force = std::min(force, 0.25);  // of 0.28 N
  const PreparedRecording clipped = prepare_recording("clipped", std::move(r));
  REQUIRE(clipped.clipped_above);
  ValidationRequest request = request_for(law, clipped);
  request.requirement = parse_requirement("10%", "test");
  const Validation v = validate(request);
  const RecordingComparison& c = v.recordings.front();
  CAPTURE(to_terminal_text(v));
  for (const QuantityKind kind :
       {QuantityKind::peak, QuantityKind::relaxation_ratio, QuantityKind::half_time}) {
    const QuantityComparison& q = of_kind(c, kind);
    CHECK(q.verdict == ModelVerdict::undetermined);
    CHECK(q.remark.value().code == "clipping");
  }
  CHECK(of_kind(c, QuantityKind::end_of_hold).verdict == ModelVerdict::adequate);
  CHECK_THAT(to_csv(v), Contains("remark") && Contains("limit of the force cell"));
  const Json quantities = to_json(v).at("recordings").front().at("quantities");
  CHECK(quantities.front().at("remarks").front().at("code") == "clipping");
  CHECK(v.verdict == ModelVerdict::undetermined);
  // The joint test is of what is known, which the law predicts.
  CHECK(c.joint.rank == 1);
  CHECK(c.joint.unknown.size() == 3);
  CHECK(c.joint.p_value > 1e-3);
  CHECK(c.curve.samples + static_cast<std::size_t>(clipped_readings(clipped).count()) ==
        *c.parts.hold_last - c.parts.ramp_first + 1);
}

TEST_CASE("a calibration residual does not ask for less uncertainty", "[validate]") {
  Random random(9);
  test::StudyNoise noise;
  noise.sigma_N = 2e-2;
  const PreparedRecording fitted = prepare_recording(
      "fitted", test::study_recording(test::study_validation(10, 0.0), noise, random));
  ValidationRequest request = request_for(quiet_law(), fitted);
  request.requirement = parse_requirement("1%", "test");
  CHECK(validate(request).recordings.front().quantities.front().remark.value().code == kMustShrink);
  request.calibration.files.push_back({"fitted", "of the bytes", fitted, ""});
  const Validation v = validate(request);
  REQUIRE(v.verdict == ModelVerdict::residual);
  for (const QuantityComparison& q : v.recordings.front().quantities) CHECK_FALSE(q.remark);
}

TEST_CASE("creep and relaxation are not pooled", "[validate]") {
  // 10 % stiffer: less force is simulated than measured, and more depth.
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, test::quiet_recording(1.1));
  for (const std::uint64_t seed : {11U, 12U}) {
    request.recordings.push_back(test::creep_recording(law, 1.1, seed));
  }
  request.recordings.push_back(test::quiet_recording(1.1, 6));
  request.requirement = parse_requirement("5%", "test");
  const Validation v = validate(request);
  CAPTURE(to_terminal_text(v));
  int forces = 0, depths = 0;
  for (const PooledQuantity& p : v.pooled) {
    CAPTURE(p.name);
    CHECK(p.recordings == 2);
    if (p.name == "force at end of hold") {
      ++forces;
      CHECK_THAT(p.e.error, WithinAbs(-0.1, 0.01));
    }
    if (p.name == "depth at end of hold") {
      ++depths;
      CHECK_THAT(p.e.error, WithinAbs(0.1 / 1.1, 0.01));
    }
  }
  CHECK(forces == 1);
  CHECK(depths == 1);
  CHECK(std::ranges::count(v.pooled, std::string("half time"), &PooledQuantity::name) == 1);
  CHECK(std::ranges::count(v.pooled, std::string("creep half time"), &PooledQuantity::name) == 1);
}

TEST_CASE("what is beyond the requirement before Holm's correction only is named", "[validate]") {
  RecordingComparison r;
  r.name = "made";
  for (const double error : {2.05, 1.0, 0.9, 1.0}) {
    QuantityComparison q;
    q.name = fmt::format("quantity {}", r.quantities.size() + 1);
    q.unit = {"N", Dimension::force, 1.0};
    q.measured = 10.0;
    q.simulated = 10.0 + error;
    q.e = {error, 0.5, std::numeric_limits<double>::infinity(), 1.96};
    r.quantities.push_back(q);
  }
  // 2.05 - 0.98 > 1 by itself, p = 0.036; of four tests 0.0125 is needed.
  judge_quantities(r, parse_requirement("1 N", "test"), Dimension::force, 10.0);
  CHECK(r.quantities.front().verdict == ModelVerdict::not_adequate);
  CHECK(r.verdict == ModelVerdict::undetermined);
  Validation v;
  v.requirement = "1 N";
  v.verdict = r.verdict;
  v.recordings = {r};
  CHECK_THAT(conclusion_words(v), Contains("before Holm's correction only: quantity 1"));
  // Without a requirement: 1.0 is beyond 0.98 by itself, p = 0.046.
  for (QuantityComparison& q : r.quantities) {
    q.e.error = 0.0;
    q.limit.reset();
  }
  r.quantities.front().e.error = 1.0;
  judge_quantities(r, std::nullopt, Dimension::force, 10.0);
  CHECK(r.quantities.front().verdict == ModelVerdict::seen);
  CHECK(r.verdict == ModelVerdict::not_seen);
  v.requirement.clear();
  v.verdict = r.verdict;
  v.recordings = {r};
  CHECK_THAT(conclusion_words(v), Contains("no model error is seen above the uncertainty; beyond"));
}

}  // namespace tpm::fit
