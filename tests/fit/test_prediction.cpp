// Predictions with bands: against the textbook, against the fit's own errors, round trips.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <numbers>

#include "coverage_studies.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/organ/scene/protocol_file.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

/// F = k u with k = 100 +- 2 N/m and readings that scatter by 3 mN.
LawFile spring_law() {
  LawFile law;
  law.spec = parse_law_name("linear", "test");
  law.spec.reference = 4e-3;
  law.values = {100.0, 1e-4, 5e-3};  // k_inf, contact, offset
  law.provenance = Provenance::derived;
  law.fitted_to = 4e-3;
  LawUncertainty u;
  u.place = {0, 2};
  u.coordinate = {Coordinate::linear, Coordinate::linear};
  u.covariance = Eigen::MatrixXd::Zero(2, 2);
  u.covariance(0, 0) = 4.0;
  u.covariance(1, 1) = 1e-6;
  u.noise.absolute = 3e-3;
  u.duration_s = 10.0;
  law.uncertainty = u;
  return law;
}

PreparedRecording noisy_recording(double phi, std::uint64_t seed, const char* sha256) {
  LawSpec law = parse_law_name("linear-1", "test");
  law.reference = 4e-3;
  Recording r = simulated_recording(law, visible_parameters(law), test::even_test(10.0, 0.05));
  Random random(seed);
  test::add_noise(r, 2e-3, phi, random);
  r.header.sha256 = sha256;
  return prepare_recording("simulated", r);
}

LawFile fitted_linear_1(const PreparedRecording& recording) {
  SetupOptions setup;
  setup.profiles = false;
  setup.reference = 4e-3;
  const std::span<const PreparedRecording> one(&recording, 1);
  return fitted_law(
      run_fit(recording_config(parse_law_name("linear-1", "test"), one, setup), data_sets(one)));
}

}  // namespace

TEST_CASE("the band of a spring is that of a straight line through the origin") {
  const LawFile law = spring_law();
  const Protocol protocol = ramp_and_hold(4e-3, 1e-3, 6.0);
  const std::vector<double> times{0.0, 1.0, 2.0, 4.0, 10.0};
  const LawPrediction p = predict_law(law, protocol, times, {});
  const double q = 1.959963984540054;
  CHECK(p.quantile == Approx(q));
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double u = std::min(times[i], 4.0) * 1e-3;  // surface: no contact depth, no offset
    CHECK(p.response[i] == Approx(100.0 * u).margin(1e-15));
    CHECK(p.standard_error[i] == Approx(2.0 * u).margin(1e-15));
    CHECK(p.mean_upper[i] == Approx(100.0 * u + q * 2.0 * u).margin(1e-15));
    CHECK(p.reading_upper[i] ==
          Approx(100.0 * u + q * std::sqrt(4.0 * u * u + 9e-6)).margin(1e-15));
  }
  PredictionOptions fitted;
  fitted.placement = Placement::fitted;
  const LawPrediction placed = predict_law(law, protocol, times, fitted);
  CHECK(placed.response[4] == Approx(100.0 * 3.9e-3 + 5e-3));
  CHECK(placed.standard_error[4] == Approx(std::hypot(2.0 * 3.9e-3, 1e-3)));
}

TEST_CASE("a t quantile is used where the size of the noise was estimated") {
  LawFile law = spring_law();
  law.uncertainty->degrees_of_freedom = 5.0;
  const LawPrediction p = predict_law(law, ramp_and_hold(4e-3, 1e-3, 6.0), std::vector{4.0}, {});
  CHECK(p.quantile == Approx(2.5705818366).epsilon(1e-9));
  PredictionOptions level;
  level.level = 0.9;
  CHECK(predict_law(law, ramp_and_hold(4e-3, 1e-3, 6.0), std::vector{4.0}, level).quantile ==
        Approx(2.0150483733).epsilon(1e-9));
}

TEST_CASE("bands from drawn laws agree with bands from derivatives where the law is well known") {
  const LawFile law = fitted_linear_1(noisy_recording(0.0, 4, "a"));
  const Protocol protocol = ramp_and_hold(3e-3, 2e-3, 8.0);
  const std::vector<double> times = times_over(protocol, 30);
  const LawPrediction by_slopes = predict_law(law, protocol, times, {});
  PredictionOptions sampled;
  sampled.samples = 4000;
  const LawPrediction by_draws = predict_law(law, protocol, times, sampled);
  for (std::size_t i = 5; i < times.size(); ++i) {
    const double half = by_slopes.mean_upper[i] - by_slopes.response[i];
    CHECK(by_draws.mean_upper[i] - by_slopes.response[i] == Approx(half).epsilon(0.12));
    CHECK(by_slopes.response[i] - by_draws.mean_lower[i] == Approx(half).epsilon(0.12));
  }
}

TEST_CASE("a law file keeps its uncertainty") {
  const LawFile law = fitted_linear_1(noisy_recording(0.6, 1, "abc"));
  REQUIRE(law.uncertainty);
  CHECK(law.uncertainty->readings_per_independent > 1.5);
  const LawFile back = law_from_json(files::to_json(law), "test");
  REQUIRE(back.uncertainty);
  const LawUncertainty &a = *law.uncertainty, &b = *back.uncertainty;
  CHECK(a.place == b.place);
  CHECK(a.coordinate == b.coordinate);
  CHECK((a.covariance - b.covariance).norm() == 0.0);
  CHECK(a.degrees_of_freedom == b.degrees_of_freedom);
  CHECK(a.noise.absolute == b.noise.absolute);
  CHECK(a.duration_s == b.duration_s);
  REQUIRE(b.data.size() == 1);
  CHECK(b.data.front().sha256 == "abc");
  CHECK(b.data.front().to_s == a.data.front().to_s);
  CHECK(to_text(files::to_json(back)) == to_text(files::to_json(law)));
}

TEST_CASE("a covariance that is none is refused") {
  const Json good = files::to_json(spring_law());
  const auto refused = [&](const std::function<void(Json&)>& change) {
    Json bad = good;
    change(bad["fit"]);
    return test::refusal_of([&] { (void)law_from_json(bad, "law.json"); });
  };
  CHECK_THAT(refused([](Json& fit) { fit["covariance"][0][1] = 1.0; }), Contains("not symmetric"));
  CHECK_THAT(refused([](Json& fit) { fit["covariance"][0][1] = fit["covariance"][1][0] = 0.01; }),
             Contains("negative eigenvalue"));
  CHECK_THAT(refused([](Json& fit) { fit["covariance"].erase(1); }), Contains("1 rows"));
  CHECK_THAT(refused([](Json& fit) { fit["parameters"][0] = "k9_N_per_m"; }),
             Contains("unknown parameter 'k9_N_per_m'"));
  CHECK_THAT(refused([](Json& fit) { fit["parameters"][1] = fit["parameters"][0]; }),
             Contains("twice"));
  LawFile bare = spring_law();
  bare.uncertainty.reset();
  CHECK_THAT(test::refusal_of([&] {
               (void)predict_law(bare, ramp_and_hold(1e-3, 1e-3, 1.0), std::vector{0.5}, {});
             }),
             Contains("carries no uncertainty"));
}

TEST_CASE("the paper's element becomes a law with the fit's own standard errors") {
  const FitConfig config = read_fit_config(TPM_TEST_SOURCE_DIR "/configs/liver_relaxation.json");
  FitConfig fast = config;
  fast.profiles = false;
  const FitResult fit = run_fit(fast);
  const LawFile law = fitted_law(fit);
  CHECK(law_name(law.spec) == "linear-1-elastic");
  CHECK(law.fitted_to == Approx(8e-3));
  int compared = 0;
  for (const FittedDatum& d : fit.data) {
    REQUIRE(d.imposed_depth_m);
    const Protocol protocol =
        ramp_and_hold(*d.imposed_depth_m, config.data.front().protocol.rate_m_per_s, 40.0);
    const LawPrediction p = predict_law(law, protocol, std::vector{d.datum.time_s}, {});
    CHECK(p.response.front() == Approx(d.predicted).epsilon(1e-8));
    REQUIRE(d.predicted_sd);
    CHECK(p.standard_error.front() == Approx(*d.predicted_sd).epsilon(1e-4));
    ++compared;
  }
  CHECK(compared == 8);
}

TEST_CASE("a recording that was fitted keeps its contact and offset, another finds its own") {
  const PreparedRecording first = noisy_recording(0.0, 1, "first");
  PreparedRecording second = noisy_recording(0.0, 2, "second");
  const LawFile law = fitted_linear_1(first);
  const LawPrediction same = predict_recording(law, first, {});
  CHECK(same.placement == Placement::fitted);
  CHECK(same.recording->held_out.samples == 0);
  CHECK(same.recording->fitted.samples > 100);
  CHECK(*same.recording->fitted.share_in_reading_band > 0.9);
  for (double& response : second.recording.response) response += 0.2;  // another zero of the cell
  const LawPrediction other = predict_recording(law, second, {});
  CHECK(other.placement == Placement::own);
  CHECK(other.offset == Approx(0.2).margin(5e-3));
  CHECK(other.recording->fitted.samples == 0);
  CHECK(*other.recording->held_out.share_in_reading_band > 0.9);
  // Its own offset is found from its own noise: nothing is known better than in the fit.
  CHECK(other.standard_error.back() > 0.5 * same.standard_error.back());
}

TEST_CASE("contact, offset and the table of an answer have units of their size") {
  LawPrediction p =
      predict_law(spring_law(), ramp_and_hold(4e-3, 1e-3, 5.0), std::vector{0.0, 4.0, 9.0}, {});
  CHECK_THAT(to_terminal_text(p), Contains("contact 0 mm, offset 0 N (") && Contains("mean N"));
  p.contact = -2.738e-7;
  p.offset = -1.952e-5;
  CHECK_THAT(to_terminal_text(p), Contains("contact -273.8 nm, offset -19.52 uN ("));
  for (auto* values : {&p.response, &p.mean_lower, &p.mean_upper}) {
    for (double& value : *values) value *= 1e-6;
  }
  const std::string text = to_terminal_text(p);
  INFO(text);
  CHECK_THAT(text, Contains("mean nN"));
  CHECK_THAT(text, !Contains("e-0"));
}

TEST_CASE("what goes beyond the fitted data is said") {
  const LawFile law = spring_law();
  const LawPrediction deep =
      predict_law(law, ramp_and_hold(8e-3, 1e-3, 30.0), std::vector{0.0, 8.0, 38.0}, {});
  REQUIRE(deep.remarks.size() == 2);
  CHECK(deep.remarks[0].code == "deeper_than_fitted");
  CHECK_THAT(deep.remarks[0].text, Contains("8 mm deep, and the law was fitted to 4 mm"));
  CHECK(deep.remarks[1].code == "longer_than_fitted");
  CHECK_THAT(deep.remarks[1].text, Contains("lasts 38 s, and the law was fitted to 10 s"));
  const LawPrediction load = predict_law(law, creep(0.2, 5.0), std::vector{1.0, 5.0}, {});
  CHECK(load.reading_lower.empty());
  CHECK(load.response.front() == Approx(2e-3));
  CHECK(load.standard_error.front() == Approx(0.02 * 2e-3));
}

TEST_CASE("a protocol is read from the blocks of a scene, its other blocks unseen") {
  const Json scene = parse_json(R"({"organ": {"anything": 1},
    "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "2 mm/s", "hold": "10 s"},
    "outputs": {"count": 5}})",
                                "test");
  REQUIRE(has_protocol(scene));
  const ProtocolFile file = parse_protocol_file(scene, "test");
  CHECK(file.protocol.peak() == Approx(4e-3));
  CHECK(file.times_s.size() == 5);
  CHECK(file.times_s.back() == Approx(12.0));
  CHECK_FALSE(has_protocol(parse_json("{\"organ\": {}}", "test")));
  const std::vector<double> times = times_over(file.protocol, 4);
  CHECK(times == std::vector<double>{0.0, 2.0, 4.0, 8.0, 12.0});
}

TEST_CASE("a law answers the sine and the recorded motion of a protocol file") {
  const LawFile law = spring_law();
  const ProtocolFile sine = parse_protocol_file(
      parse_json(
          R"({"protocol": {"kind": "sine", "depth": "4 mm", "frequency": "2 Hz", "cycles": 3},
        "outputs": {"count": 25}})",
          "test"),
      "test");
  REQUIRE(sine.times_s.size() == 25);
  CHECK(sine.times_s.back() == Approx(1.5));
  const LawPrediction wave = predict_law(law, sine.protocol, sine.times_s, {});
  for (std::size_t i = 0; i < sine.times_s.size(); ++i) {
    const double turn = 2.0 * std::numbers::pi * 2.0 * sine.times_s[i];
    // F = k u with u = (1 - cos 2 pi f t) d/2, exact at the 64 points of a cycle.
    const double expected = 100.0 * 2e-3 * (1.0 - std::cos(turn));
    CHECK(wave.response[i] == Approx(expected).margin(1e-12));
    CHECK(wave.standard_error[i] == Approx(0.02 * expected).margin(1e-12));
  }
  const test::TempFolder folder;
  // Counted from its first reading, in time and in depth.
  std::ofstream(folder / "push.csv")
      << "time s,depth mm,force N\n5,1,0\n6,2,0.1\n8,4,0.3\n10,4,0.25\n";
  const ProtocolFile recorded =
      parse_protocol_file(parse_json(R"({"protocol": {"kind": "recording", "file": "push.csv"},
        "outputs": {"count": 6}})",
                                     "test"),
                          (folder / "protocol.json"));
  const LawPrediction push = predict_law(law, recorded.protocol, recorded.times_s, {});
  REQUIRE(recorded.times_s == std::vector<double>{0.0, 1.0, 2.0, 3.0, 4.0, 5.0});
  const std::vector<double> depth_m{0.0, 1e-3, 2e-3, 3e-3, 3e-3, 3e-3};
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    CHECK(push.response[i] == Approx(100.0 * depth_m[i]).margin(1e-15));
  }
}

}  // namespace tpm::fit
