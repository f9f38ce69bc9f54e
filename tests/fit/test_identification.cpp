// Identification sample by sample: whitening and REML against dense algebra, the sequential fit
// against the batch fit, nothing of the future, hand-over without energy.
#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "coverage_studies.hpp"
#include "expected_values.hpp"
#include "random_hand_over.hpp"
#include "refusal.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/online/identification.hpp"
#include "tpm/fit/online/identified_loop.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

std::vector<double> uneven_times() {
  return {0.0, 0.1, 0.2, 0.35, 0.4, 0.5, 0.8, 0.9, 1.0, 1.1, 1.15, 1.3};
}

Eigen::MatrixXd dense_correlation(const std::vector<double>& time_s, double phi, double step_s) {
  const auto n = std::ssize(time_s);
  Eigen::MatrixXd r(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double dt =
          std::abs(time_s[static_cast<std::size_t>(i)] - time_s[static_cast<std::size_t>(j)]);
      r(i, j) = std::pow(phi, dt / step_s);
    }
  }
  return r;
}

PreparedRecording simulated_law(const char* name, double noise, double phi, std::uint64_t seed,
                                double hold_s = 10.0) {
  LawSpec law = parse_law_name(name, "test");
  law.reference = 4e-3;
  Recording r = simulated_recording(law, visible_parameters(law), test::even_test(hold_s, 0.05));
  const double peak = *std::max_element(r.response.begin(), r.response.end());
  Random random(seed);
  test::add_noise(r, noise * peak, phi, random);
  return prepare_recording("simulated", r);
}

IdentifyOptions only(const char* name) {
  IdentifyOptions options;
  options.laws = {parse_law_name(name, "test")};
  options.reference = 4e-3;
  return options;
}

}  // namespace

TEST_CASE("whitening is the inverse root of the dense correlation, unevenly sampled too") {
  const std::vector<double> t = uneven_times();
  const AutoregressiveNoise noise(0.7, 0.1);
  const Eigen::MatrixXd r = dense_correlation(t, 0.7, 0.1);
  Eigen::MatrixXd whitener = Eigen::MatrixXd::Identity(r.rows(), r.cols());
  noise.whiten(t, whitener);
  const Eigen::MatrixXd unit = whitener * r * whitener.transpose();
  CHECK((unit - Eigen::MatrixXd::Identity(r.rows(), r.cols())).cwiseAbs().maxCoeff() < 1e-13);
  CHECK(noise.log_determinant(t) == Approx(std::log(r.determinant())).epsilon(1e-12));
}

TEST_CASE("REML is the minimum of the dense restricted deviance") {
  std::vector<double> t{0.0};
  while (t.size() < 60) t.push_back(t.back() + (t.size() % 3 == 0 ? 0.15 : 0.1));
  const auto n = std::ssize(t);
  Random random(3);
  Eigen::MatrixXd j(n, 2);
  Eigen::VectorXd r(n);
  double noise = random.normal();
  for (Eigen::Index i = 0; i < n; ++i) {
    j(i, 0) = 1.0;
    j(i, 1) = t[static_cast<std::size_t>(i)];
    noise = 0.6 * noise + 0.8 * random.normal();
    r[i] = 2.0 + 3.0 * j(i, 1) + noise;
  }
  const auto criterion = [&](double phi) {
    const Eigen::MatrixXd inverse = dense_correlation(t, phi, 0.1).inverse();
    const Eigen::MatrixXd gram = j.transpose() * inverse * j;
    const Eigen::VectorXd x = gram.ldlt().solve(j.transpose() * inverse * r);
    const Eigen::VectorXd rest = r - j * x;
    return static_cast<double>(n - 2) * std::log(rest.dot(inverse * rest)) -
           std::log(inverse.determinant()) + std::log(gram.determinant());
  };
  const AutoregressionEstimate e = estimate_autoregression(t, r, j, 0.1);
  for (int i = 0; i < 19; ++i) CHECK(criterion(e.phi) <= criterion(0.05 * i) + 1e-6);
  REQUIRE(e.phi > 0.0);
  const double h = 1e-3;
  const double curvature =
      (criterion(e.phi + h) - 2.0 * criterion(e.phi) + criterion(e.phi - h)) / (h * h);
  CHECK(e.phi_variance == Approx(2.0 / curvature).epsilon(0.1));
}

TEST_CASE("after the last sample the sequential fit is the fit of all samples") {
  const PreparedRecording recording = simulated_law("linear-1", 0.01, 0.0, 5);
  const Identification id = identify(recording, only("linear-1"));
  SetupOptions setup;
  setup.profiles = false;
  setup.reference = 4e-3;
  setup.measured = false;  // nor does identify() take a measured zero and contact
  const std::span<const PreparedRecording> one(&recording, 1);
  const FitResult fit =
      run_fit(recording_config(parse_law_name("linear-1", "test"), one, setup), data_sets(one));
  const SequentialEstimate& last = id.history.back().estimate;
  REQUIRE(last.parameters.size() == fit.parameters.size());
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const SequentialParameter& p = last.parameters[i];
    REQUIRE(p.parameter.name == fit.parameters[i].parameter.name);
    const double theta = p.parameter.theta(fit.parameters[i].estimate);
    // phi is estimated near 0, not exactly 0: a small part of a standard error.
    CHECK(std::abs(p.parameter.theta(p.estimate) - theta) < 0.3 * p.standard_error);
    const double fitted_sd =
        *fit.parameters[i].standard_error / std::abs(p.parameter.natural_slope(theta));
    CHECK(p.standard_error / fitted_sd == Approx(1.0).margin(0.25));
  }
}

TEST_CASE("intervals follow the profile along a contact between few samples") {
  // Independent: tpm fit minimises over all other parameters at each value of one.
  LawSpec law = parse_law_name("linear-1", "test");
  law.reference = 4e-3;
  const SimulatedTest test = test::even_test(10.0, 0.02);
  const Recording clean = simulated_recording(law, visible_parameters(law), test);
  const double peak = *std::max_element(clean.response.begin(), clean.response.end());
  Random random(11);
  int wider = 0;
  for (int i = 0; i < 12; ++i) {
    Recording noisy = clean;
    noisy.header.sha256 = "simulated";
    test::add_noise(noisy, 0.02 * peak, 0.0, random);
    // What is followed sample by sample has no zero that was measured beforehand.
    PreparedRecording recording = prepare_recording("simulated", noisy);
    keep_baseline(recording);
    SetupOptions setup;
    setup.measured = false;
    setup.reference = law.reference;
    const std::span<const PreparedRecording> one(&recording, 1);
    const FitResult fit = run_fit(recording_config(law, one, setup), data_sets(one));
    SequentialSettings settings;
    settings.reference = law.reference;
    SequentialFit sequential(law, noisy.drive_quantity, noisy.response_quantity, settings);
    for (std::size_t k = 0; k < noisy.time_s.size(); ++k) {
      sequential.add(noisy.time_s[k], noisy.drive[k], noisy.response[k]);
    }
    const SequentialEstimate& end = sequential.estimate().value();
    for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
      const SequentialParameter& p = end.parameters[k];
      if (p.parameter.name != "k1" || end.phi > 0.02 || !fit.parameters[k].upper) continue;
      const double plain = 1.96 * p.standard_error;
      const double at = p.parameter.theta(fit.parameters[k].estimate);
      const double fitted = p.parameter.theta(*fit.parameters[k].upper) - at;
      const double found = p.parameter.theta(p.upper) - p.parameter.theta(p.estimate);
      CAPTURE(i, fitted / plain, found / plain);
      CHECK(found == Approx(fitted).epsilon(0.03));
      if (fitted > 1.1 * plain) ++wider;
    }
  }
  CHECK(wider >= 1);  // else nothing was tried
}

TEST_CASE("a contact that stands on a sample is not gone through again at every sample") {
  LawSpec law = parse_law_name("linear-1", "test");
  law.reference = 4e-3;
  const SimulatedTest test = test::even_test(20.0, 0.02);
  Recording clean = simulated_recording(law, visible_parameters(law), test);
  const double peak = *std::max_element(clean.response.begin(), clean.response.end());
  Random random(3);
  for (int i = 0; i < 3; ++i) {  // the third ends with contact on a sample
    Recording r = clean;
    test::add_noise(r, 0.02 * peak, 0.0, random);
    SequentialSettings settings;
    settings.reference = law.reference;
    SequentialFit fit(law, r.drive_quantity, r.response_quantity, settings);
    for (std::size_t k = 0; k < r.time_s.size(); ++k) {
      fit.add(r.time_s[k], r.drive[k], r.response[k]);
    }
    CAPTURE(i, fit.passes());
    CHECK(fit.passes() < test::allowed_cost("identify.passes"));
  }
}

TEST_CASE("nothing of the future is used") {
  const PreparedRecording whole = simulated_law("linear-1", 0.01, 0.5, 8);
  const Identification all = identify(whole, only("linear-1"));
  Recording cut = whole.recording;
  const std::size_t kept = 150;
  cut.time_s.resize(kept);
  cut.drive.resize(kept);
  cut.response.resize(kept);
  const Identification early = identify(prepare_recording("simulated", cut), only("linear-1"));
  const IdentifiedSample& then = early.history.back();
  const auto same = std::find_if(all.history.begin(), all.history.end(),
                                 [&](const auto& s) { return s.time_s == then.time_s; });
  REQUIRE(same != all.history.end());
  for (std::size_t i = 0; i < then.estimate.parameters.size(); ++i) {
    CHECK(same->estimate.parameters[i].estimate == then.estimate.parameters[i].estimate);
    CHECK(same->estimate.parameters[i].lower == then.estimate.parameters[i].lower);
  }
}

TEST_CASE("intervals narrow, correlated noise widens them, and a target stops") {
  IdentifyOptions options = only("linear-1");
  options.target = 0.1;
  const Identification white = identify(simulated_law("linear-1", 0.01, 0.0, 11), options);
  const Identification correlated = identify(simulated_law("linear-1", 0.01, 0.9, 11), options);
  REQUIRE(white.stopped);
  CHECK(white.result().estimate.widest_relative_half_width() <= 0.1);
  CHECK(white.history.back().estimate.phi < 0.3);
  CHECK(correlated.history.back().estimate.phi > 0.6);
  CHECK(correlated.history.back().estimate.widest_relative_half_width() >
        1.5 * white.history.back().estimate.widest_relative_half_width());
  CHECK_THAT(test::refusal_of([&] {
               IdentifyOptions bad = options;
               bad.patience = 0.5;
               (void)identify(simulated_law("linear-1", 0.01, 0.0, 11), bad);
             }),
             Contains("patience 0.5"));
  CHECK_THAT(test::refusal_of([&] {
               (void)identify(simulated_law("linear-1", 0.01, 0.0, 11), only("hertz-1"));
             }),
             Contains("cannot be fitted sample by sample"));
}

TEST_CASE("the identified law carries its covariance to predictions") {
  const PreparedRecording recording = simulated_law("linear-1", 0.01, 0.0, 11);
  const Identification id = identify(recording, only("linear-1"));
  const LawFile law = identified_law(id, recording);
  REQUIRE(law.uncertainty);
  CHECK(law.uncertainty->noise.absolute == id.result().estimate.sigma);
  const LawPrediction p = predict_recording(law, recording, {});
  CHECK(*p.recording->held_out.share_in_reading_band > 0.9);
}

TEST_CASE("the answer of an identification has 25 lines at most, in units of its size") {
  const PreparedRecording recording = simulated_law("linear-1", 0.01, 0.0, 11);
  const Identification id = identify(recording, only("linear-1"));
  ShortAnswer answer = short_answer(id);
  answer.limits.push_back(loop_words(replay_in_loop(id, recording, {})));
  end_answer(answer, "identified", {"law.json"}, "tpm hil run configs/hil_law.json");
  const std::string text = to_text(answer);
  INFO(text);
  CHECK(std::count(text.begin(), text.end(), '\n') <= 25);
  CHECK_THAT(text, Catch::Contains(id.stopped ? "stopped at " : "at the end, "));
  for (const SequentialParameter& p : id.result().estimate.parameters) {
    CHECK_THAT(text, Catch::Contains("\n" + p.parameter.name + " "));
  }
  for (const Remark& remark : id.remarks) CHECK_THAT(text, Catch::Contains(remark.text));
  CHECK(text.find("e-0") == std::string::npos);
  CHECK_THAT(text, Catch::Contains("the first law entered the loop at "));
}

TEST_CASE("stored energy never rises by more than the work") {
  Random random(2);
  for (int trial = 0; trial < 40; ++trial) {
    const LawFile law = test::random_law(random);
    LawInLoop loop(
        law, {.period_s = 1e-4, .longest_s = 2.0, .deepest_m = 8e-3, .deepest_valid_m = 1e-2});
    double work = 0.0, worst = 0.0, scale = 0.0, before = 0.0, force_before = 0.0;
    for (int i = 0; i <= 8000; ++i) {
      const double t = 1e-4 * i;
      const double u = 3e-3 * std::min(1.0, 10.0 * t) * (1.0 + 0.4 * std::sin(15.0 * t));
      (void)loop.contact.step(Eigen::Vector3d(0.0, 0.0, u));
      const double force = loop.force_N();
      work += 0.5 * (force + force_before) * (u - before);
      force_before = force;
      before = u;
      scale = std::max(scale, loop.stored_J());
      worst = std::max(worst, loop.stored_J() - work);
    }
    CAPTURE(law_name(law.spec), worst, scale);
    CHECK(worst < 2e-5 * scale);  // the work by trapezoids
    CHECK(loop.stored_J() > 0.0);
  }
}

TEST_CASE("a hand-over keeps the force and stores no more energy") {
  Random random(1);
  int possible = 0;
  for (int i = 0; i < 500; ++i) {
    const test::HandOverOutcome o = test::random_hand_over(random);
    if (!o.decision.possible) {
      CHECK(!(o.decision.energy_after_J <= o.decision.energy_before_J &&
              o.decision.relaxed_kernel_m == 0.0));
      continue;
    }
    ++possible;
    CHECK(o.force_jump_N <= 1e-12 * o.largest_force_N);
    CHECK(o.energy_risen_J <= 1e-12 * o.largest_energy_J);
  }
  CHECK(possible > 50);
  CHECK(possible < 500);  // and it is refused where it would give energy
}

TEST_CASE("at rest every law may take the place of every other") {
  Random random(9);
  for (int i = 0; i < 50; ++i) {
    const LawContactSettings settings{
        .period_s = 1e-3, .longest_s = 10.0, .deepest_m = 8e-3, .deepest_valid_m = 1e-2};
    const LawInLoop from(test::random_law(random), settings);
    LawInLoop to(test::random_law(random), settings);
    const HandOver decision = consider_hand_over(from, to);
    CHECK(decision.possible);
    hand_over(decision, to);
    CHECK(to.force_N() == 0.0);
    CHECK(to.stored_J() == 0.0);
  }
}

TEST_CASE("laws that are identified are handed to the loop") {
  const PreparedRecording recording = simulated_law("linear-1", 0.01, 0.0, 11);
  const Identification id = identify(recording, only("linear-1"));
  const IdentifiedLoop loop = replay_in_loop(id, recording, {});
  REQUIRE(loop.first_s);
  REQUIRE_FALSE(loop.hand_overs.empty());
  for (const LoopHandOver& h : loop.hand_overs) {
    if (!h.done_s) continue;
    CHECK(*h.done_s >= h.asked_s);
    CHECK(h.decision.energy_after_J <= h.decision.energy_before_J);
  }
  const files::Json list = to_json(loop)["hand_overs"];
  REQUIRE(list.size() == loop.hand_overs.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    const bool last = i + 1 == list.size();
    const char* const waiting = last ? "waits" : "replaced";
    CHECK(list[i]["state"] == (loop.hand_overs[i].done_s ? "done" : waiting));
  }
}

}  // namespace tpm::fit
