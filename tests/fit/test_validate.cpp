// tpm validate: against closed forms, second implementations, and simulated recordings whose model
// error is known.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "refusal.hpp"
#include "support/remarks.hpp"
#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

/// Rest to 1 s, ramp of 2 mm/s to 4 mm, hold to 33 s, every 0.05 s.
PreparedRecording ramp_hold(const std::function<double(double)>& response) {
  Recording r;
  r.header.id = "made";
  for (int i = 0; i <= 660; ++i) {
    const double t = 0.05 * i;
    r.time_s.push_back(t);
    r.drive.push_back(2e-3 * std::clamp(t - 1.0, 0.0, 2.0));
    r.response.push_back(response(t));
  }
  return prepare_recording("made", r);
}

double read_quantity_of(const PreparedRecording& r, QuantityKind kind, double at = 0.0) {
  const Eigen::VectorXd curve = Eigen::VectorXd::Map(
      r.recording.response.data(), static_cast<Eigen::Index>(r.recording.response.size()));
  return read_quantity({kind, at}, parts_of(r), r.recording, 0.0, curve).value().value;
}

Validation validated(const LawFile& law, const PreparedRecording& recording,
                     const char* requirement = nullptr) {
  ValidationRequest request;
  request.law_file = "law.json";
  request.law = law;
  request.recordings = {recording};
  if (requirement != nullptr) request.requirement = parse_requirement(requirement, "test");
  return validate(request);
}

/// As the base material with 0.2 mN of noise and contact where the depth starts.
LawFile base_law() {
  Random random(3);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  return test::study_calibration(1, noise, random);
}

PreparedRecording validation_of(double stiffer, double sigma, int rest, std::uint64_t seed) {
  Random random(seed);
  test::StudyNoise noise;
  noise.sigma_N = sigma;
  return prepare_recording("validation", test::study_recording(test::study_validation(rest, 0.0),
                                                               noise, random, stiffer));
}

}  // namespace

TEST_CASE("a line of least squares is read without error", "[validate]") {
  const std::vector<double> x{0.0, 1.0, 2.5, 7.0};
  Eigen::VectorXd y(4);
  for (int i = 0; i < 4; ++i) y[i] = 3.0 - 2.0 * x[static_cast<std::size_t>(i)];
  CHECK_THAT(line_weights(x, -4.0).dot(y), WithinRel(11.0, 1e-14));
  CHECK_THAT(line_weights(x, 2.0).sum(), WithinRel(1.0, 1e-14));
}

TEST_CASE("quantities of a ramp and hold have their closed forms", "[validate]") {
  // Falls by 1 N/s from 5 N at the corner, 3 s: the line through the samples is the curve.
  const auto linear = ramp_hold([](double t) { return t < 3.0 ? 5.0 : 5.0 - 0.1 * (t - 3.0); });
  const RecordingParts parts = parts_of(linear);
  CHECK_THAT(parts.corner_s, WithinAbs(3.0, 1e-9));
  CHECK_THAT(read_quantity_of(linear, QuantityKind::peak), WithinRel(5.0, 1e-9));
  CHECK_THAT(read_quantity_of(linear, QuantityKind::at_time, 10.0), WithinRel(5.0 - 0.7, 1e-9));
  // Mean over the last tenth, 30 s to 33 s.
  CHECK_THAT(read_quantity_of(linear, QuantityKind::end_of_hold),
             WithinRel(5.0 - 0.1 * 28.5, 1e-9));
  CHECK_THAT(read_quantity_of(linear, QuantityKind::relaxation_ratio), WithinRel(2.15 / 5.0, 1e-9));
  // 2.85 / 2 below 5 N, on a straight line.
  CHECK_THAT(read_quantity_of(linear, QuantityKind::half_time), WithinRel(14.25, 1e-6));
  const auto ramp = ramp_hold([](double t) { return 100.0 * std::clamp(t - 1.0, 0.0, 2.0); });
  CHECK_THAT(read_quantity_of(ramp, QuantityKind::at_depth, 2e-3), WithinRel(100.0, 1e-9));
}

TEST_CASE("a quantity's weights are its derivatives by the samples", "[validate]") {
  const auto r = ramp_hold(
      [](double t) { return t < 3.0 ? 2.0 * (t - 1.0) : 3.0 + std::exp(-(t - 3.0) / 4.0); });
  const RecordingParts parts = parts_of(r);
  Eigen::VectorXd curve = Eigen::VectorXd::Map(
      r.recording.response.data(), static_cast<Eigen::Index>(r.recording.response.size()));
  Eigen::VectorXd change(curve.size());
  for (Eigen::Index i = 0; i < change.size(); ++i)
    change[i] = 1e-5 * std::sin(0.02 * static_cast<double>(i));
  for (const QuantityKind kind :
       {QuantityKind::peak, QuantityKind::end_of_hold, QuantityKind::relaxation_ratio}) {
    const auto at = [&](double factor) {
      return read_quantity({kind}, parts, r.recording, 0.0, curve + factor * change)->value;
    };
    const Functional f = read_quantity({kind}, parts, r.recording, 0.0, curve).value();
    CHECK_THAT(f.weight.dot(change), WithinRel(0.5 * (at(1.0) - at(-1.0)), 1e-6));
  }
}

TEST_CASE("work of a loop is the area that the curve encloses", "[validate]") {
  Recording r;
  r.header.id = "loop";
  for (int i = 0; i <= 200; ++i) {
    r.time_s.push_back(0.1 * i);
    const double up = i <= 100 ? i : 200 - i;
    r.drive.push_back(1e-5 * up);
    r.response.push_back((i <= 100 ? 2e-2 : 1e-2) * up);
  }
  // Triangles of 2 N and 1 N over 1 mm; the corner's sample belongs to the ramp.
  CHECK_THAT(read_quantity_of(prepare_recording("loop", r), QuantityKind::work),
             WithinRel(5e-4, 0.02));
}

TEST_CASE("the variance of a weighted sum of correlated readings is that of the dense matrix",
          "[validate]") {
  ReadingScatter scatter;
  scatter.sigma = 0.3;
  scatter.phi = 0.7;
  scatter.step_s = 0.1;
  std::vector<double> t;
  Eigen::VectorXd w(12);
  for (int i = 0; i < 12; ++i) {
    t.push_back(0.1 * i + (i > 6 ? 0.25 : 0.0));  // a gap
    w[i] = std::cos(i);
  }
  double sum = 0.0;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      sum += w[i] * w[j] * std::pow(0.7, std::abs(t[a] - t[b]) / 0.1);
    }
  }
  CHECK_THAT(scatter.of(t, w), WithinRel(0.3 * std::sqrt(sum), 1e-12));
  // The mean of n readings: sigma sqrt((1 + 2 sum (1 - k/n) phi^k) / n).
  const std::vector<double> even{0.0, 0.1, 0.2, 0.3};
  const double expected =
      0.3 * std::sqrt((1.0 + 2.0 * (0.75 * 0.7 + 0.5 * 0.49 + 0.25 * 0.343)) / 4.0);
  CHECK_THAT(scatter.of(even, Eigen::VectorXd::Constant(4, 0.25)), WithinRel(expected, 1e-12));
}

TEST_CASE("uncertainties combine with Welch and Satterthwaite's degrees of freedom", "[validate]") {
  CombinedUncertainty sum;
  sum.add(3.0, 4.0);
  sum.add(4.0, 9.0);
  CHECK_THAT(sum.u(), WithinRel(5.0, 1e-14));
  CHECK_THAT(sum.degrees(), WithinRel(625.0 / (81.0 / 4.0 + 256.0 / 9.0), 1e-14));
  CHECK_THAT(coverage_factor(4.0), WithinRel(2.7764451051977987, 1e-12));
  CHECK_THAT(coverage_factor(std::numeric_limits<double>::infinity()),
             WithinRel(1.959963984540054, 1e-12));
}

TEST_CASE("a verdict follows |E|, U and R", "[validate]") {
  const ErrorWithUncertainty e{-3.0, 1.0, 10.0, 2.0};
  CHECK(judge_error(e, 5.0) == ModelVerdict::adequate);
  CHECK(judge_error(e, 4.9) == ModelVerdict::undetermined);
  CHECK(judge_error(e, 1.0) == ModelVerdict::undetermined);
  CHECK(judge_error(e, 0.9) == ModelVerdict::not_adequate);
  CHECK(judge_error(e, std::nullopt) == ModelVerdict::seen);
  CHECK(judge_error({-3.0, 1.5, 10.0, 2.0}, std::nullopt) == ModelVerdict::not_seen);
  CHECK(holm_rejects({0.01, 0.04, 0.03}) == std::vector<bool>{true, false, false});
  CHECK(holm_rejects({0.01, 0.02, 0.03}) == std::vector<bool>{true, true, true});
  CHECK(what_must_shrink({-3.0, 1.0, 10.0, 2.0}, 4.0, {{"a", 0.6}, {"b", 0.8}},
                         {"N", Dimension::force, 1.0}) ==
        "b from u = 0.8 to nearly 0 N and a from u = 0.6 to 0.5 N");
}

TEST_CASE("a requirement is a share, an amount or what a hand can tell", "[validate]") {
  CHECK(parse_requirement("10%", "--require").value == Approx(0.1));
  CHECK(parse_requirement("0.1", "--require").share);
  const Requirement amount = parse_requirement("20 mN", "--require");
  CHECK_FALSE(amount.share);
  CHECK(amount.value == Approx(0.02));
  CHECK(amount.dimension == Dimension::force);
  CHECK(parse_requirement("jnd", "--require").value == Approx(0.07));
  for (const char* bare : {"20", "1", "1e3"}) {
    CHECK_THAT(test::refusal_of([&] { (void)parse_requirement(bare, "--require"); }),
               Contains("has no unit"));
  }
  CHECK(parse_requirement("JND", "--require").of_force);
  CHECK(parse_requirement("99.9%", "--require").share);
  for (const char* all : {"100%", "200%", "1e3 %"}) {
    CHECK_THAT(test::refusal_of([&] { (void)parse_requirement(all, "--require"); }),
               Contains("as large as the quantity") && Contains("below 100 %"));
  }
  for (const char* none : {"0", "0%", "-5%", "-3 mN", "20 kg", "nan", "nan%", "inf%", "%", ""}) {
    CHECK_THROWS_AS(parse_requirement(none, "--require"), Error);
  }
  CHECK_THAT(test::refusal_of([] { (void)parse_requirement("big", "--require"); }),
             Contains("10%"));
  CHECK_THAT(test::refusal_of([] { (void)parse_requirement("0%", "--require"); }),
             Contains("above 0"));
}

TEST_CASE("the area metric has its closed forms", "[validate]") {
  // One value at the mean: 2 phi(0); one far away: its distance.
  const std::vector<double> zero{0.0};
  CHECK_THAT(area_metric(zero, 0.0, 1.0),
             WithinRel(2.0 / std::sqrt(2.0 * std::numbers::pi), 1e-14));
  CHECK_THAT(area_metric(std::vector<double>{40.0}, 0.0, 1.0), WithinRel(40.0, 1e-14));
  CHECK_THAT(area_metric(std::vector<double>{1.0, 2.0}, 0.0, 0.0), WithinRel(1.5, 1e-14));
  // Units carry through.
  const std::vector<double> values{3.0, 5.0, 4.2}, scaled{3e-3, 5e-3, 4.2e-3};
  CHECK_THAT(area_metric(scaled, 4e-3, 1e-3),
             WithinRel(1e-3 * area_metric(values, 4.0, 1.0), 1e-12));
}

TEST_CASE("the area metric is numpy's", "[validate]") {
  // numpy: the sum of |F - G| over the sorted union, and Gauss-Legendre quadrature between the
  // steps.
  const std::vector<double> a{0.3, -1.2, 0.9, 2.1, 0.05}, b{0.0, 1.0, -0.5};
  CHECK_THAT(area_metric(a, b), WithinAbs(0.57, 1e-12));
  CHECK_THAT(area_metric(a, 0.1, 0.8), WithinAbs(0.4403209129262285, 1e-12));
}

TEST_CASE("one draw of a right prediction is 1.13 sigma off, five 0.54", "[validate]") {
  const std::vector<double> one{0.2}, five{-1.0, -0.3, 0.1, 0.4, 1.2};
  const AreaMetric m = standard_area(one, Eigen::MatrixXd::Zero(1, 1), std::vector<double>{1.0});
  CHECK_THAT(m.null_mean, WithinAbs(2.0 / std::sqrt(std::numbers::pi), 0.03));
  const AreaMetric n =
      standard_area(five, Eigen::MatrixXd::Zero(5, 1), std::vector<double>(5, 1.0));
  CHECK_THAT(n.null_mean, WithinAbs(0.54, 0.02));
  CHECK(n.lower.has_value());
  CHECK_FALSE(m.lower.has_value());
}

TEST_CASE("an instrument's limits become standard uncertainties", "[validate]") {
  const double third = 1.0 / std::numbers::sqrt3;
  CHECK(parse_channel_uncertainty("0.5 % of reading", Dimension::force, {}, "i").relative ==
        Approx(0.005 * third));
  CHECK(parse_channel_uncertainty("10 um", Dimension::length, {}, "i").absolute ==
        Approx(1e-5 * third));
  CHECK(parse_channel_uncertainty("0.1 % of range", Dimension::force, 10.0, "i").absolute ==
        Approx(0.01 * third));
  CHECK(parse_channel_uncertainty("1 mN (standard)", Dimension::force, {}, "i").absolute ==
        Approx(1e-3));
  CHECK(parse_channel_uncertainty("1 % of reading (k = 2)", Dimension::force, {}, "i").relative ==
        Approx(0.005));
  CHECK_THAT(test::refusal_of([] {
               (void)parse_channel_uncertainty("0.1 % of range", Dimension::force, {}, "i");
             }),
             Contains("force_range"));
  CHECK_THAT(
      test::refusal_of([] { (void)parse_channel_uncertainty("1 %", Dimension::force, {}, "i"); }),
      Contains("of reading"));
}

TEST_CASE("a material 5 % stiffer is seen, the same material is not", "[validate]") {
  const LawFile law = base_law();
  const Validation same = validated(law, validation_of(1.0, 2e-4, 200, 5));
  CHECK(same.verdict == ModelVerdict::not_seen);
  CHECK_THAT(to_terminal_text(same), Contains("no model error is seen above the uncertainty"));
  const Validation stiff = validated(law, validation_of(1.05, 2e-4, 200, 6));
  CHECK(stiff.verdict == ModelVerdict::seen);
  const QuantityComparison& end =
      test::study_quantity(stiff.recordings.front(), QuantityKind::end_of_hold);
  CHECK_THAT(end.e.error, WithinAbs(-0.05 * 60.0 * 3e-3, 3.0 * end.e.u_val));
  CHECK(validated(law, validation_of(1.05, 2e-4, 200, 6), "10%").verdict == ModelVerdict::adequate);
  CHECK(validated(law, validation_of(1.05, 2e-4, 200, 6), "1%").verdict ==
        ModelVerdict::not_adequate);
}

TEST_CASE("a short rest in much noise leaves 15 % undetermined, and the zero is named",
          "[validate]") {
  const LawFile law = base_law();
  const PreparedRecording noisy = validation_of(1.15, 0.06, 10, 4);
  INFO(to_terminal_text(validated(law, noisy)));
  CHECK(validated(law, noisy).verdict == ModelVerdict::not_seen);
  const Validation v = validated(law, noisy, "10%");
  CHECK(v.verdict == ModelVerdict::undetermined);
  const QuantityComparison& end =
      test::study_quantity(v.recordings.front(), QuantityKind::end_of_hold);
  CHECK(end.parts.front().name == "the zero of the force");
  CHECK(validated(law, validation_of(1.4, 0.06, 400, 8)).verdict == ModelVerdict::seen);
}

TEST_CASE("data that were fitted get no verdict", "[validate]") {
  LawFile law = base_law();
  PreparedRecording recording = validation_of(1.0, 2e-4, 40, 9);
  recording.recording.header.sha256 = "abc";
  ValidationRequest request;
  request.law = law;
  request.recordings = {recording};
  request.requirement = parse_requirement("10%", "test");
  request.calibration.files.push_back({"fitted.csv", "abc", std::nullopt});
  const Validation v = validate(request);
  CHECK(v.verdict == ModelVerdict::residual);
  CHECK_FALSE(v.answers_yes());
  CHECK_THAT(to_terminal_text(v), Contains("calibration residual"));
  CHECK(to_json(v).at("verdict") == "calibration_residual");
}

TEST_CASE("an instrument that calibration and validation share hides its scale", "[validate]") {
  const LawFile law = base_law();
  const PreparedRecording recording = validation_of(1.0, 2e-4, 200, 10);
  ComparisonOptions options;
  Instrument cell;
  cell.id = "cell";
  cell.force = ChannelUncertainty{0.01, 0.0};
  options.instrument = options.calibration_instrument = cell;
  const double same =
      test::study_quantity(compare_with_recording(law, recording, options), QuantityKind::peak)
          .e.u_val;
  options.calibration_instrument->id = "another";
  const QuantityComparison apart =
      test::study_quantity(compare_with_recording(law, recording, options), QuantityKind::peak);
  CHECK_THAT(apart.e.u_val, WithinRel(0.01 * std::numbers::sqrt2 * apart.measured, 0.05));
  CHECK(same < 0.2 * apart.e.u_val);
}

TEST_CASE(
    "without a rest quantities that need the zero are undetermined until an instrument states it",
    "[validate]") {
  const LawFile law = base_law();
  const PreparedRecording recording =
      prepare_recording("cut", test::study_recording_without_rest());
  ComparisonOptions options;
  const RecordingComparison r = compare_with_recording(law, recording, options);
  CHECK(r.placement.zero_readings == 0);
  CHECK(test::study_quantity(r, QuantityKind::peak).verdict == ModelVerdict::undetermined);
  CHECK(test::study_quantity(r, QuantityKind::peak).remark.value().code == "zero_not_known");
}

TEST_CASE("contact by a force is uncertain by a step of the drive", "[validate]") {
  // 0.4 mm between samples: the one that passes 5 mN lies up to 0.35 mm beyond where 5 mN is
  // reached, which makes the same material look stiffer by a seventh.
  const LawFile law = base_law();
  Random random(14);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  PhaseOptions phases;
  phases.contact_response = 5e-3 + noise.zero_N;
  const PreparedRecording r = prepare_recording(
      "threshold", test::study_recording(test::study_validation(40, 0.0), noise, random), phases);
  ComparisonOptions options;
  options.known = KnownPlacement::threshold;
  const RecordingComparison c = compare_with_recording(law, r, options);
  CHECK_THAT(c.placement.contact_u_sampled, WithinRel(0.4e-3 / std::numbers::sqrt3, 0.01));
  for (const QuantityKind kind : {QuantityKind::peak, QuantityKind::end_of_hold}) {
    const QuantityComparison& q = test::study_quantity(c, kind);
    CAPTURE(q.name, q.e.error, q.e.expanded());
    CHECK(std::abs(q.e.error) > 0.05 * q.measured);
    CHECK(std::abs(q.e.error) <= q.e.expanded());
    CHECK_THAT(q.parts.front().name, Contains("contact point"));
  }
  CHECK(c.joint.p_value > 0.05);
}

TEST_CASE("a contact by force that the fit did not use is remarked", "[validate]") {
  ValidationRequest request;
  request.law_file = "law.json";
  request.law = base_law();
  FittedFile file;
  file.name = "calibration.csv";
  file.contact = 1e-5;
  request.law.uncertainty->data = {file};
  request.recordings = {validation_of(1.0, 2e-4, 40, 15)};
  request.contact_by_threshold = true;
  const auto remarked = [&] {
    return test::has_remark(validate(request).remarks, "contact_by_threshold");
  };
  CHECK_THAT(to_terminal_text(validate(request)), Contains("fitted without --contact-force"));
  CHECK(remarked());
  request.law.uncertainty->data.front().held = {"contact"};
  CHECK_FALSE(remarked());
}

TEST_CASE("the onset is found where contact begins", "[validate]") {
  const LawFile law = base_law();
  Random random(12);
  test::StudyNoise clean;
  clean.sigma_N = 1e-7;
  const PreparedRecording r = prepare_recording(
      "onset", test::study_recording(test::study_validation(40, 0.4), clean, random));
  const RecordingComparison c = compare_with_recording(law, r, {});
  // At most 0.2 % of the force: 6 um of 3 mm.
  CHECK_THAT(c.placement.contact, WithinAbs(0.4e-3, 6e-6));
}

}  // namespace tpm::fit
