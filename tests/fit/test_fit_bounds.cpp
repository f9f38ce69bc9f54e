// Bounds that decide an answer, and profiles that fail.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "fitted_parameter.hpp"
#include "one_law.hpp"
#include "support/creep_recordings.hpp"
#include "support/remarks.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/show/recording_report.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

namespace {

/// Ramp of 3 mm at 2 mm/s and a hold; the specimen was touched `before` above where it begins.
PreparedRecording pressed_from_the_start(double before, double exponent) {
  LawSpec spec = parse_law_name("power-1", "test");
  spec.reference = 5e-3;
  const std::vector<double> values{100.0, 120.0, 2.0, exponent, -before, 0.0};
  Recording r;
  for (int i = 0; i < 200; ++i) {
    r.time_s.push_back(0.05 * i);
    r.drive.push_back(std::min(3e-3, 2e-3 * r.time_s.back()));
  }
  // The contact has rested at its first depth.
  Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  history.set_equilibrium_at_start(true);
  const Eigen::VectorXd f = LawModel(spec).respond(history, r.time_s, values, Want::values).value;
  Random random(11);
  for (const double force : f) r.response.push_back(force + 2e-4 * f.maxCoeff() * random.normal());
  return prepare_recording("pressed.csv", r);
}

FitResult fitted_power(const PreparedRecording& r, bool widen) {
  const std::vector<PreparedRecording> one{r};
  FitConfig config = recording_config(parse_law_name("power-1", "test"), one, {});
  for (EstimatedParameter& p : config.parameters) {
    if (!widen) p.widest.reset();
  }
  return run_fit(config, data_sets(one));
}

/// A material of 2 s, fitted with an automatic upper bound of 0.1 s.
/// @param widest how far the bounds may go, if not as far as they are made
FitResult fitted_below_its_tau(const std::optional<WidestBounds>& widest) {
  const std::vector<PreparedRecording> one{pressed_from_the_start(0.0, 1.5)};
  FitConfig config = recording_config(parse_law_name("power-1", "test"), one, {});
  for (EstimatedParameter& p : config.parameters) {
    if (p.fit.name != "tau1") continue;
    p.fit.lower = 0.01;
    p.fit.start = 0.02;
    p.fit.upper = 0.1;
    if (widest) p.widest = widest;
  }
  return run_fit(config, data_sets(one));
}

}  // namespace

TEST_CASE("The contact of a recording that begins in contact may lie two depths before it",
          "[bounds]") {
  const PreparedRecording r = pressed_from_the_start(2e-3, 2.5);
  const FitResult fit = fitted_power(r, true);
  const ParameterResult& exponent = find(fit, "exponent");
  const ParameterResult& contact = find(fit, "contact");
  CHECK_FALSE(contact.at_lower_bound);
  CHECK(contact.nuisance);
  // Its bounds are physical: nothing widens them.
  CHECK_FALSE(contact.first_bounds);
  CHECK_THAT(contact.parameter.lower, WithinRel(-6e-3, 1e-9));
  CHECK(exponent.conditional_on.empty());
  CHECK(exponent.lower.value() < 2.5);
  CHECK(exponent.upper.value() > 2.5);
  CHECK(contact.lower.value() < -2e-3);
  CHECK(contact.upper.value() > -2e-3);
  CHECK_THAT(fmt::format("{}", fmt::join(remark_texts(fit.remarks), "\n")),
             Contains("stated: no samples before contact, so its depth is an unknown"));
}

TEST_CASE("Automatic bounds of the material are widened, and a note says so", "[bounds]") {
  const FitResult fit = fitted_below_its_tau({});
  const ParameterResult& tau = find(fit, "tau1");
  REQUIRE(tau.first_bounds);
  CHECK(tau.first_bounds->upper == 0.1);
  CHECK(tau.parameter.upper > 2.0);
  CHECK_THAT(std::string(test::remark_text(fit.remarks, "bounds_widened")),
             Contains("the automatic bounds of tau1 were widened from 0.01 s .. 0.1 s"));
}

TEST_CASE("Bounds that could be widened by rounding alone stay, and nothing is said", "[bounds]") {
  const FitResult fit = fitted_below_its_tau(WidestBounds{0.01, 0.1 * (1.0 + 1e-15)});
  const ParameterResult& tau = find(fit, "tau1");
  CHECK(tau.at_upper_bound);
  CHECK_FALSE(tau.first_bounds);
  CHECK_FALSE(test::has_remark(fit.remarks, "bounds_widened"));
}

TEST_CASE("A widening tells the bounds apart however small it is", "[bounds]") {
  const FitResult fit = fitted_below_its_tau(WidestBounds{0.01, 0.100001});
  CHECK_THAT(std::string(test::remark_text(fit.remarks, "bounds_widened")),
             Contains("tau1 were widened from 0.01 s .. 0.1 s to 0.01 s .. 0.100001 s"));
}

TEST_CASE("Verdicts that depend on a nuisance parameter on its bound are conditional", "[bounds]") {
  // Touched further away than automatic bounds go.
  const PreparedRecording r = pressed_from_the_start(12e-3, 3.0);
  const FitResult fit = fitted_power(r, true);
  const ParameterResult& contact = find(fit, "contact");
  REQUIRE(contact.at_lower_bound);
  CHECK_THAT(contact.parameter.lower, WithinRel(-6e-3, 1e-9));
  const ParameterResult& exponent = find(fit, "exponent");
  REQUIRE(exponent.conditional_on.size() == 1);
  CHECK(exponent.conditional_on.front() == Condition{"contact", false, -6e-3, true});
  CHECK_THAT(exponent.summary, Contains("this holds only with contact at its lower bound -6 mm"));

  const Json json = to_json(fit);
  for (const Json& p : json.at("parameters")) {
    if (p.at("name") != "exponent") continue;
    CHECK(p.at("verdict") == "identified, conditional on contact at its lower bound");
    CHECK(p.at("conditional_on").at(0).at("parameter") == "contact");
    CHECK(p.at("conditional_on").at(0).at("bound_SI") == -6e-3);
  }
  CHECK_THAT(to_terminal_text(fit),
             Contains("identified, conditional on contact at its lower bound") &&
                 Contains("upper limit only; on its lower bound") &&
                 Contains("note: contact is on its lower bound -6 mm: what is said of k_inf"));
  CHECK_THAT(recording_figure(fit, 0).caption, Contains("presses on a bound of contact (-6 mm)"));

  const Selection s = test::select_one("power-1", r);
  CHECK_FALSE(s.candidates.front().identified);
  CHECK_THAT(s.candidates.front().reason, Contains("contact ends at its lower bound, and k_inf"));
}

TEST_CASE("An interval that a bound of the contact point cuts says so", "[bounds]") {
  const PreparedRecording r = pressed_from_the_start(2e-3, 2.5);
  const std::vector<PreparedRecording> one{r};
  FitConfig config = recording_config(parse_law_name("power-1", "test"), one, {});
  const double estimate = find(fitted_power(r, true), "contact").estimate;
  for (EstimatedParameter& p : config.parameters) {
    p.widest.reset();
    if (p.fit.name == "contact") p.fit.lower = estimate - 1e-6;  // within the interval
  }
  const FitResult fit = run_fit(config, data_sets(one));
  CHECK_FALSE(find(fit, "contact").at_lower_bound);
  const ParameterResult& exponent = find(fit, "exponent");
  REQUIRE(exponent.conditional_on.size() == 1);
  CHECK_FALSE(exponent.conditional_on.front().at_estimate);
  CHECK_THAT(exponent.summary, Contains("its interval ends with contact at its lower bound"));
}

TEST_CASE("A profile that fails is not a flat profile", "[bounds]") {
  // The creep of a Maxwell element, u = F/k (1 + t/tau), with noise that is said to be smaller than
  // rounding.
  PointSet creep;
  creep.header.id = "maxwell";
  creep.observable = Observable::indentation_depth;
  creep.time_origin = TimeOrigin::load_applied;
  for (int i = 1; i <= 20; ++i) {
    Datum d;
    d.load_N = 0.5;
    d.time_s = 0.05 * i;
    d.value = 0.5 / 100.0 * (1.0 + *d.time_s);
    d.provenance = Provenance::derived;
    creep.data.push_back(d);
  }
  const Json document = parse_json(R"({
    "title": "exact", "law": {"name": "linear-1-fluid", "drive": "indentation_depth",
                              "reference": "5 mm"},
    "parameters": {
      "k1": {"start": "80 N/m", "lower": "1 N/m", "upper": "10000 N/m", "scale": "log",
             "sets": ["k1"]},
      "tau1": {"start": "3 s", "lower": "0.001 s", "upper": "1000 s", "scale": "log",
               "sets": ["tau1"]}},
    "data": [{"dataset": "maxwell", "protocol": {"kind": "creep"},
              "noise": {"kind": "absolute", "absolute": "1e-18 mm"}}],
    "starts": {"count": 4, "seed": 0}})",
                                   "test");
  const FitResult fit = run_fit(parse_fit_config(document, "test"), {creep});
  const ParameterResult& tau = find(fit, "tau1");
  CHECK_THAT(tau.estimate, WithinRel(1.0, 1e-9));
  CHECK(tau.standard_error.value() < 1e-9);
  CHECK(tau.verdict == Verdict::failed);
  CHECK(has_failed(tau.profile.below));
  CHECK(has_failed(tau.profile.above));
  CHECK_THAT(tau.summary, Contains("its profile failed on both sides") &&
                              Contains("does not mean that it is unknown") &&
                              Contains("linearised standard error"));
  CHECK_THAT(to_terminal_text(fit), Contains("profile failed") && !Contains("every value from"));
  const Json p = to_json(fit).at("parameters").at(1);
  CHECK(p.at("verdict") == "profile failed");
  CHECK(p.at("profile_failed") == Json({"lower", "upper"}));
  CHECK(p.at("interval_SI") == Json({nullptr, nullptr}));
}

TEST_CASE("A rest before contact keeps contact and offset off their bounds", "[bounds]") {
  // A straight kernel that rests where the tissue begins: what the rest measured of the zero tells
  // depth and offset apart.
  LawSpec spec = parse_law_name("linear-1", "test");
  Recording r;
  for (int i = 0; i < 240; ++i) {
    r.time_s.push_back(0.1 * i);
    r.drive.push_back(std::min(5e-3, std::max(0.0, 2e-3 * (r.time_s.back() - 1.0))));
  }
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd f =
      LawModel(spec)
          .respond(history, r.time_s, std::vector<double>{100.0, 120.0, 3.0, 0.0, 0.0},
                   Want::values)
          .value;
  int on_bound = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    r.response.clear();
    for (const double force : f) {
      r.response.push_back(force + 0.005 * f.maxCoeff() * random.normal());
    }
    const std::vector<PreparedRecording> one{prepare_recording("r.csv", r)};
    const FitResult fit = run_fit(recording_config(spec, one, {}), data_sets(one));
    on_bound += find(fit, "contact").at_lower_bound ? 1 : 0;
    CHECK(find(fit, "offset").conditional_on.empty());
    CHECK(find(fit, "k_inf").conditional_on.empty());
    CHECK(find(fit, "tau1").conditional_on.empty());
  }
  CHECK(on_bound == 0);
}

TEST_CASE("The strain without a load of creep has physical bounds, which nothing widens",
          "[bounds]") {
  test::CreepTrial trial;
  trial.rest_s = 4.0;
  trial.strain_zero = 2e-3;
  const PreparedRecording r = prepare_recording("creep.csv", test::creep_recording_of(trial));
  REQUIRE(r.load_imposed);
  const FitConfig config = recording_config(parse_law_name("linear-1", "test"), {&r, 1}, {});
  const auto zero = std::ranges::find_if(config.parameters,
                                         [](const auto& p) { return p.fit.name == "strain_zero"; });
  REQUIRE(zero != config.parameters.end());
  CHECK_FALSE(zero->widest);
  CHECK(zero->fit.lower < trial.strain_zero);
  CHECK(zero->fit.upper > trial.strain_zero);
  // Every strain under the stress lies beyond it.
  double least = 1.0;
  for (std::size_t i = 0; i < r.recording.time_s.size(); ++i) {
    if (r.recording.drive[i] > 0.5 * trial.stress_Pa) {
      least = std::min(least, r.recording.response[i]);
    }
  }
  CHECK(zero->fit.upper < least + 5.0 * trial.noise);
}

TEST_CASE("The slack length of a strip has physical bounds, which nothing widens", "[bounds]") {
  // Taut from the start: along a power of no material a slack length far below it fits best.
  Recording strip;
  strip.drive_quantity = Quantity::relative_length;
  strip.response_quantity = Quantity::stress;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    strip.time_s.push_back(t);
    strip.drive.push_back(1.0 + std::min(0.1, 0.1 * t));
    strip.response.push_back(1e3 * std::exp(40.0 * (strip.drive.back() - 1.0)));
  }
  const PreparedRecording r = prepare_recording("strip.csv", strip);
  SetupOptions setup;
  setup.starts = 5;
  setup.profiles = false;
  const FitConfig config = recording_config(parse_law_name("power", "test"), {&r, 1}, setup);
  const auto slack = std::ranges::find_if(
      config.parameters, [](const auto& p) { return p.fit.name == "slack_length"; });
  REQUIRE(slack != config.parameters.end());
  CHECK_FALSE(slack->widest);
  CHECK_THAT(slack->fit.lower, WithinRel(1.0 - 2.0 * 0.1, 1e-9));
  CHECK_THAT(slack->fit.upper, WithinRel(1.0 + 0.9 * 0.1, 1e-9));
  const FitResult fit = run_fit(config, data_sets({&r, 1}));
  CHECK_FALSE(find(fit, "slack_length").first_bounds);
}

TEST_CASE("The zero of a stress is not moved further than what was read", "[bounds]") {
  Recording pulled;
  pulled.drive_quantity = Quantity::strain;
  pulled.response_quantity = Quantity::stress;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    pulled.time_s.push_back(t);
    pulled.drive.push_back(std::min(0.1, 0.1 * t));
    pulled.response.push_back(1e3 * pulled.drive.back() * (1.0 + 0.5 * std::exp(-t / 2.0)));
  }
  const PreparedRecording r = prepare_recording("pulled.csv", pulled);
  const FitConfig config = recording_config(parse_law_name("linear-1", "test"), {&r, 1}, {});
  const auto offset =
      std::ranges::find_if(config.parameters, [](const auto& p) { return p.fit.name == "offset"; });
  REQUIRE(offset != config.parameters.end());
  CHECK_FALSE(offset->widest);
}

TEST_CASE("Creep under a load that was on before the recording is refused", "[bounds]") {
  const auto weight = [](double noise_N, bool pressed) {
    Recording r;
    Random random(3);
    for (int i = 0; i < 300; ++i) {
      const double t = 0.1 * i;
      r.time_s.push_back(t);
      r.drive.push_back(3e-3 + 1e-3 * (1.0 - std::exp(-t / 4.0)) + 1e-6 * random.normal());
      r.response.push_back((pressed ? 20.0 * r.drive.back() : 0.3) + noise_N * random.normal());
    }
    const std::vector<PreparedRecording> one{prepare_recording("weight.csv", r)};
    static_cast<void>(recording_config(parse_law_name("linear-1", "test"), one, {}));
  };
  for (const double noise_N : {0.0, 1e-4}) {
    CAPTURE(noise_N);
    CHECK_THROWS_WITH(weight(noise_N, false),
                      Contains("creep under a load that was on before") &&
                          Contains("how far it went before is unknown") &&
                          Contains("the recording from before the load on"));
  }
  // A force that follows the depth is no kept load.
  CHECK_NOTHROW(weight(1e-4, true));
}

TEST_CASE("a step that ends on a bound does not pass it by its rounding") {
  Random random(5);
  int at_bound = 0;
  for (int i = 0; i < 1000; ++i) {
    const double k = std::exp(random.normal()), tau = std::exp(random.normal());
    const std::vector<FitParameter> both{
        {"k1", parse_unit("N/m", "test"), Scale::linear, k, 0.0, 3.0 * k},
        {"tau1", parse_unit("s", "test"), Scale::log, tau, 0.3 * tau, 1.7 * tau}};
    const std::vector<double> start{k, tau};
    const Eigen::Vector2d by(-4.0 * k * random.uniform(), 6.0 * tau * (random.uniform() - 0.5));
    const std::vector<double> moved = moved_within_bounds(both, {0, 1}, start, by);
    for (std::size_t j = 0; j < both.size(); ++j) {
      CHECK(moved[j] >= both[j].lower);
      CHECK(moved[j] <= both[j].upper);
      at_bound += moved[j] == both[j].lower || moved[j] == both[j].upper ? 1 : 0;
    }
  }
  CHECK(at_bound > 100);
}
