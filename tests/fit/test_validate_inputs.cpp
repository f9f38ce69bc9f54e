// What u_input holds besides the law's parameters: the radius of a probe, and a new specimen.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "quiet_recordings.hpp"
#include "refusal.hpp"
#include "tpm/fit/validate/instrument_effects.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::quiet_law;
using test::quiet_recording;
using test::request_for;

constexpr double kRadiusU = 0.01;

Instrument with_probe(const std::string& probe, std::optional<double> radius_m = std::nullopt) {
  Instrument instrument;
  instrument.id = "cell";
  instrument.probe = probe;
  instrument.probe_radius = radius_m;
  instrument.radius = kRadiusU;
  return instrument;
}

double part_of(const QuantityComparison& q, const std::string& name) {
  const auto found = std::ranges::find(q.parts, name, &UncertaintyPart::name);
  return found == q.parts.end() ? 0.0 : found->u;
}

/// A law of 60 + 45 exp(-t / 2 s) N/m with another kernel; its covariance is that of the linear
/// one.
LawFile law_of(const char* name, std::vector<double> values) {
  LawFile law = quiet_law();
  law.spec = parse_law_name(name, "test");
  law.spec.reference = 4e-3;
  law.values = std::move(values);
  return law;
}

/// The text on the screen without its line breaks.
std::string said_of(const Validation& v) {
  std::string words;
  for (const char c : to_terminal_text(v)) {
    const bool blank = c == ' ' || c == '\n';
    if (!blank || (!words.empty() && words.back() != ' ')) words += blank ? ' ' : c;
  }
  return words;
}

}  // namespace

TEST_CASE("the effect of a probe's radius has its closed forms", "[validate]") {
  // A flat punch: F ~ R. Hertz's sphere: F ~ R^(1/2). A cone has none: F ~ R^0.
  struct Case {
    const char* law;
    std::vector<double> values;
    double exponent;
  };
  const std::vector<Case> cases{{"linear-1", {60.0, 45.0, 2.0, 0.0, 0.0}, 1.0},
                                {"hertz-1", {60.0, 45.0, 2.0, 0.0, 0.0}, 0.5},
                                {"power-1", {60.0, 45.0, 2.0, 2.0, 0.0, 0.0}, 0.0}};
  for (const Case& c : cases) {
    CAPTURE(c.law);
    ComparisonOptions options;
    options.known = KnownPlacement::surface;
    options.instrument = with_probe("b");
    options.calibration_instrument = with_probe("a");
    const RecordingComparison r =
        compare_with_recording(law_of(c.law, c.values), quiet_recording(1.0), options);
    for (const QuantityKind kind : {QuantityKind::peak, QuantityKind::end_of_hold}) {
      const QuantityComparison& q = test::study_quantity(r, kind);
      const double expected = kRadiusU * c.exponent * q.simulated;
      CHECK_THAT(part_of(q, "the radius of the probe"), WithinAbs(expected, 1e-6 * q.simulated));
      CHECK_THAT(part_of(q, "the radius of the calibration's probe"),
                 WithinAbs(expected, 1e-6 * q.simulated));
      const double law = part_of(q, "the law's parameters");
      CHECK_THAT(q.u_input, WithinRel(std::hypot(law, expected, expected), 1e-6));
    }
    // Both forces grow alike: their ratio is the same for any probe.
    const QuantityComparison& ratio = test::study_quantity(r, QuantityKind::relaxation_ratio);
    CHECK_THAT(part_of(ratio, "the radius of the probe"), WithinAbs(0.0, 1e-7));
  }
}

TEST_CASE("of creep a flat punch sinks by 1/R", "[validate]") {
  const LawFile law = quiet_law();
  ComparisonOptions options;
  options.instrument = with_probe("b");
  const RecordingComparison r =
      compare_with_recording(law, test::creep_recording(law, 1.0, 5), options);
  const QuantityComparison& end = test::study_quantity(r, QuantityKind::end_of_hold);
  CHECK_THAT(part_of(end, "the radius of the probe"), WithinRel(kRadiusU * end.simulated, 1e-5));
}

TEST_CASE("Hertz's creep follows the radius by its third root", "[validate]") {
  // u ~ F^(2/3) R^(-1/3)
  CHECK_THAT(slope_by_radius(3e-3, 2.0 / 3.0 * 3e-3, true), WithinRel(-1e-3, 1e-12));
}

TEST_CASE("one probe in calibration and validation adds nothing, and the text says so",
          "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  request.instruments = {with_probe("tip 2")};
  request.calibration.instrument = with_probe("tip 2");
  const auto peak_of = [&] {
    return test::study_quantity(validate(request).recordings.front(), QuantityKind::peak);
  };
  const auto said = [&] {
    return to_json(validate(request)).at("recordings")[0].value("probe", std::string());
  };
  CHECK(peak_of().of_probe == 0.0);
  CHECK_THAT(peak_of().u_input, WithinRel(part_of(peak_of(), "the law's parameters"), 1e-12));
  CHECK_THAT(said_of(validate(request)), Contains("one probe in calibration and"));
  // Not named: it comes with the instrument, whose errors are the same where the id is.
  request.instruments = {with_probe("")};
  request.calibration.instrument = with_probe("");
  CHECK_THAT(said(), Contains("one probe"));
  request.calibration.instrument->id = "another";
  CHECK_THAT(said(), Contains("the radii of two probes"));
  CHECK(peak_of().u_input > 0.01 * peak_of().simulated);
  request.calibration.instrument.reset();
  CHECK_THAT(said(), Contains("validation's probe alone"));
  CHECK_THAT(part_of(peak_of(), "the radius of the calibration's probe"), WithinAbs(0.0, 1e-15));
  // Another size is no uncertainty: the law is that of the calibration's probe.
  request.instruments = {with_probe("b", 3e-3)};
  request.calibration.instrument = with_probe("a", 2e-3);
  CHECK_THAT(said_of(validate(request)),
             Contains("a radius of 3 mm, that of the calibration 2 mm"));
}

TEST_CASE("recordings of one probe share the error of its radius, those of two do not",
          "[validate]") {
  ValidationRequest request = request_for(quiet_law(), quiet_recording(1.0, 5));
  request.recordings.push_back(quiet_recording(1.0, 6));
  request.recordings.back().name = "second";
  request.calibration.instrument = with_probe("a");
  request.quantities = {{QuantityKind::peak}};
  const auto pooled = [&](const char* first, const char* second) {
    request.instruments = {with_probe(first), with_probe(second)};
    return validate(request).pooled.front();
  };
  const PooledQuantity one = pooled("b", "b"), two = pooled("b", "c"), fitted = pooled("a", "a");
  const double effect = kRadiusU * one.simulated;
  CHECK_THAT(std::pow(two.u_shared, 2) - std::pow(fitted.u_shared, 2),
             WithinRel(effect * effect, 1e-4));  // the calibration's, which both have
  CHECK_THAT(std::pow(one.u_shared, 2) - std::pow(two.u_shared, 2),
             WithinRel(effect * effect, 1e-4));
}

TEST_CASE("a radius is stated as an amount of it or a share", "[validate]") {
  const auto read = [](const Json& block, Dimension response = Dimension::force) {
    return read_instrument(block, response, Dimension::length, "i");
  };
  const Instrument share = read({{"id", "c"}, {"probe", "tip"}, {"radius", "0.5 % of radius"}});
  CHECK_THAT(share.radius.value(), WithinRel(0.005 / std::numbers::sqrt3, 1e-12));
  CHECK(share.probe_id() == "probe tip");
  const Instrument amount =
      read({{"id", "c"}, {"probe_radius", "2 mm"}, {"radius", "10 um (standard)"}});
  CHECK_THAT(amount.radius.value(), WithinRel(0.005, 1e-12));
  CHECK(amount.probe_id() == "instrument c");
  const auto refused = [&](const Json& block, Dimension response = Dimension::force) {
    return test::refusal_of([&] { (void)read(block, response); });
  };
  CHECK_THAT(refused({{"id", "c"}, {"radius", "10 um"}}), Contains("\"probe_radius\" beside it"));
  CHECK_THAT(refused({{"id", "c"}, {"radius", "1 %"}}), Contains("0.5 % of radius"));
  CHECK_THAT(refused({{"id", "c"}, {"radius", "1 % of reading"}}), Contains("0.5 % of radius"));
  CHECK_THAT(refused({{"id", "c"}, {"probe_radius", "0 mm"}}), Contains("above 0"));
  CHECK_THAT(refused({{"id", "c"}, {"radius", "1 % of radius"}}, Dimension::stress),
             Contains("no force over a depth"));
}

TEST_CASE("a new specimen adds the spread between those of the calibration", "[validate]") {
  // Hardly any noise: D of recording j is its factor times the force of factor 1.
  const std::vector<double> factors{0.8, 1.0, 1.05, 1.3};
  double mean = 0.0, square = 0.0;
  for (const double f : factors) mean += f / 4.0;
  for (const double f : factors) square += (f - mean) * (f - mean) / 3.0;
  const double sd = std::sqrt(square);
  Random random(20);
  test::StudyNoise noise;
  noise.sigma_N = 1e-5;
  ValidationRequest request = test::study_of_specimens(factors, noise, random);
  request.recordings = {quiet_recording(1.2)};
  request.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  const Validation v = validate(request);
  for (const SpecimenSpread& s : v.specimens) {
    CHECK(s.degrees() == 3);
    CHECK_THAT(s.with_own, WithinRel(s.tau(), 0.01));
    CHECK_THAT(s.of_mean, WithinRel(0.5, 1e-9));
  }
  const QuantityComparison& end =
      test::study_quantity(v.recordings.front(), QuantityKind::end_of_hold);
  const double tau = sd * end.measured / 1.2;
  CHECK_THAT(end.of_specimen.norm(), WithinRel(tau, 0.01));
  CHECK_THAT(end.e.u_val, WithinRel(tau * std::sqrt(1.25), 0.01));
  CHECK_THAT(end.e.degrees, WithinRel(3.0, 0.02));
  CHECK(end.parts.front().name == "the spread between specimens");
  CHECK(end.verdict == ModelVerdict::not_seen);
  const std::string text = said_of(v);
  INFO(text);
  CHECK_THAT(text, Contains("validated with new specimens: validation") &&
                       Contains("between its 4 recordings, each a specimen"));
  CHECK_THAT(to_json(v).at("new_specimen")[0].at("tau_share_of_S").get<double>(),
             WithinRel(v.specimens.front().tau(), 1e-5));
  // The same specimens: 20 % stiffer is a model error.
  request.new_specimen = false;
  CHECK(validate(request).verdict == ModelVerdict::seen);
  CHECK_FALSE(to_json(validate(request)).contains("new_specimen"));
}

TEST_CASE("a spread between specimens that is estimated as 0 is no better known", "[validate]") {
  // Recordings of one specimen, with noise: n - 1 degrees of freedom tell of a tau up to the limit.
  test::StudyNoise noise;
  noise.sigma_N = 2e-2;
  Validation v;
  for (unsigned seed = 22; seed < 40; ++seed) {  // about every second study estimates 0
    Random random(seed);
    ValidationRequest request = test::study_of_specimens({1.0, 1.0, 1.0}, noise, random);
    request.recordings = {quiet_recording(1.0)};
    request.quantities = {{QuantityKind::peak}};
    v = validate(request);
    REQUIRE(v.specimens.size() == 1);
    if (v.specimens.front().tau() == 0.0) break;
  }
  const SpecimenSpread& spread = v.specimens.front();
  REQUIRE(spread.tau() == 0.0);
  const QuantityComparison& peak = test::study_quantity(v.recordings.front(), QuantityKind::peak);
  // The recording is so quiet beside them that no coverage factor says what a new specimen may do.
  CHECK(peak.unknown);
  CHECK(peak.verdict == ModelVerdict::undetermined);
  CHECK(peak.remark.value().code == "spread_hidden");
  CHECK_THAT(spread.tau_at_most(),  // chi^2 with two degrees: -2 ln 0.95
             WithinRel(spread.with_own * std::sqrt(-1.0 / std::log(0.95) - 1.0), 1e-9));
  CHECK_THAT(said_of(v),
             Contains("no spread between the 3 recordings of the calibration is seen") &&
                 Contains("% of S is not excluded"));
}

TEST_CASE("a difference of variances is known as its minuend is", "[validate]") {
  CombinedUncertainty sum;
  sum.add(3.0, std::numeric_limits<double>::infinity());
  sum.add_difference(0.0, 2.0, 2.0);
  CHECK_THAT(sum.u(), WithinRel(3.0, 1e-15));
  CHECK_THAT(sum.degrees(), WithinRel(81.0 / 8.0, 1e-15));
  CHECK_FALSE(sum.untold());
  sum.add_difference(0.0, 4.0, 2.0);
  CHECK(sum.untold());
  CombinedUncertainty one;  // a difference with nothing taken off is a variance
  one.add_difference(2.0, 2.0, 3.0);
  CHECK_THAT(one.degrees(), WithinRel(3.0, 1e-15));
  CHECK_FALSE(one.untold());
}

TEST_CASE("the spread between specimens is refused where nothing tells it", "[validate]") {
  Random random(21);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  ValidationRequest two = test::study_of_specimens({0.9, 1.1}, noise, random);
  two.recordings = {quiet_recording(1.0)};
  const auto refused = [](const ValidationRequest& request) {
    return test::refusal_of([&] { (void)validate(request); });
  };
  ValidationRequest request = two;
  request.calibration.files.pop_back();
  CHECK_THAT(refused(request), Contains("--new-specimen") && Contains("fitted to 1 recording"));
  request = two;
  request.calibration.files.back().recording.reset();
  CHECK_THAT(refused(request), Contains("specimen 1 was not found"));
  request = two;
  request.presses = {{}};
  CHECK_THAT(refused(request), Contains("with a session"));
  // A quantity that the calibration does not have gets no verdict.
  const LawFile law = two.law;
  two.recordings = {test::creep_recording(law, 1.0, 5)};
  const Validation v = validate(two);
  INFO(to_terminal_text(v));
  CHECK(v.verdict == ModelVerdict::undetermined);
  CHECK_THAT(said_of(v), Contains("the spread between specimens is not known"));
}

}  // namespace tpm::fit
