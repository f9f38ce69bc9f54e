// Fits of oscillatory data: storage and loss over frequency, alone and together with recordings.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "fitted_parameter.hpp"
#include "gradient_check.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/design/coverage.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/show/fit_report.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::Matchers::WithinRel;

namespace {

std::vector<double> log_spaced(double from, double to, std::size_t n) {
  std::vector<double> values(n);
  for (std::size_t i = 0; i < n; ++i) {
    values[i] = from * std::pow(to / from, static_cast<double>(i) / static_cast<double>(n - 1));
  }
  return values;
}

LawSpec indentation_law(const std::string& name) {
  LawSpec spec = parse_law_name(name, "test");
  spec.reference = 2e-3;
  return spec;
}

/// The dynamic stiffness of a law about a depth, exact; computed, not measured.
Spectrum computed_spectrum(const LawSpec& law, const std::vector<double>& parameters,
                           std::vector<double> frequency_Hz,
                           std::optional<double> depth = std::nullopt) {
  const SpectrumResponse k = respond_spectrum(law, parameters, frequency_Hz, depth, Want::values);
  Spectrum s;
  s.provenance = Provenance::derived;
  s.dimension = quantity_dimension(law.response) == Dimension::stress ? Dimension::stress
                                                                      : Dimension::stiffness;
  s.frequency_Hz = std::move(frequency_Hz);
  s.storage.assign(k.storage.begin(), k.storage.end());
  s.loss.assign(k.loss.begin(), k.loss.end());
  return s;
}

Spectrum scattered_spectrum(Spectrum s, double sigma, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = 0; i < s.storage.size(); ++i) {
    s.storage[i] += sigma * random.normal();
    s.loss[i] += sigma * random.normal();
  }
  return s;
}

/// As the testers of rubber and tissue quote it: the stiffness over A0/l0.
Spectrum as_modulus(Spectrum s, double stiffness_per_modulus_m) {
  s.dimension = Dimension::stress;
  for (double& v : s.storage) v /= stiffness_per_modulus_m;
  for (double& v : s.loss) v /= stiffness_per_modulus_m;
  return s;
}

const std::string kOscillation = R"({"kind": "oscillation"})";

/// An entry of /data; members of `more` are added to it.
std::string entry(const std::string& name, const std::string& protocol, const std::string& noise,
                  const std::string& more = "") {
  return fmt::format(R"({{"dataset": "{}", "protocol": {}, "noise": {}{}}})", name, protocol, noise,
                     more);
}

std::string absolute(const std::string& sigma) {
  return R"({"kind": "absolute", "absolute": ")" + sigma + "\"}";
}

FitConfig config_of(const std::string& law, const std::string& parameters, const std::string& data,
                    std::size_t starts = 4) {
  const std::string text = R"({"title": "computed", "law": {"name": ")" + law +
                           R"(", "reference": "2 mm"}, "parameters": {)" + parameters +
                           R"(}, "data": [)" + data + R"(], "starts": {"count": )" +
                           std::to_string(starts) + "}}";
  return parse_fit_config(parse_json(text, "f.json"), "f.json");
}

std::string searched(const std::string& name, const std::string& start, const std::string& lower,
                     const std::string& upper) {
  return fmt::format(R"("{}": {{"start": "{}", "lower": "{}", "upper": "{}"}})", name, start, lower,
                     upper);
}

std::string stiffness(const std::string& name, const std::string& start = "30 N/m") {
  return searched(name, start, "0.1 N/m", "10000 N/m");
}

std::string relaxation_time(const std::string& name, const std::string& start = "0.1 s") {
  return searched(name, start, "0.0001 s", "100 s");
}

const std::string kOneBranch =
    stiffness("k_inf") + ", " + stiffness("k1") + ", " + relaxation_time("tau1");

/// True values of the joint fit: k_inf, k1 (N/m), tau1 (s), contact, offset.
const std::vector<double> kFast{40.0, 60.0, 0.05, 0.0, 0.0};

/// A ramp of 1 s to 2 mm and a hold to 10 s of linear-1, scattered by 1 mN, a sample each 0.25 s:
/// too coarse for the relaxation of `kFast`.
Recording slow_recording() {
  Recording r;
  r.provenance = Provenance::derived;
  for (int i = 0; i <= 40; ++i) {
    r.time_s.push_back(0.25 * i);
    r.drive.push_back(2e-3 * std::min(r.time_s.back(), 1.0));
  }
  const Response answer = LawModel(indentation_law("linear-1"))
                              .respond(measured_history(Drive::displacement, r.time_s, r.drive),
                                       r.time_s, kFast, Want::values);
  Random random(5);
  for (const double force : answer.value) r.response.push_back(force + 1e-3 * random.normal());
  return r;
}

/// 60 to 300 Hz, where 1/tau1 is far below.
Spectrum fast_spectrum() {
  return scattered_spectrum(
      computed_spectrum(indentation_law("linear-1"), kFast, log_spaced(60.0, 300.0, 12)), 1.0, 6);
}

}  // namespace

TEST_CASE("a spectrum gives the law back that made it, with derivatives to match") {
  const std::vector<double> true_values{40.0, 60.0, 30.0, 0.02, 1.0, 0.0, 0.0};
  const Spectrum exact =
      computed_spectrum(indentation_law("linear-2"), true_values, log_spaced(0.02, 50.0, 12));
  const FitConfig config = config_of(
      "linear-2", kOneBranch + ", " + stiffness("k2") + ", " + relaxation_time("tau2", "2 s"),
      entry("a", kOscillation, absolute("0.5 N/m")));
  const ExperimentResiduals function(config, {DataSet(exact)});
  REQUIRE(function.data().size() == 24);
  CHECK(function.data()[0].quantity == Quantity::storage_stiffness);
  CHECK(function.data()[1].label == "loss at 0.02 Hz");
  std::vector<FitParameter> parameters;
  for (const EstimatedParameter& p : config.parameters) parameters.push_back(p.fit);
  const GradientCheck gradient = check_gradient(function, parameters, {});
  CHECK(gradient.wrong == 0);
  CHECK(gradient.passed());
  const FitResult fit = fit_experiments(function);
  CHECK(fit.chi_square < 1e-12);
  // The two branches may have changed places.
  const bool swapped = find(fit, "tau1").estimate > find(fit, "tau2").estimate;
  CHECK_THAT(find(fit, swapped ? "tau2" : "tau1").estimate, WithinRel(0.02, 1e-6));
  CHECK_THAT(find(fit, swapped ? "k1" : "k2").estimate, WithinRel(30.0, 1e-6));
  CHECK_THAT(find(fit, "k_inf").estimate, WithinRel(40.0, 1e-6));
}

TEST_CASE("intervals from scattered spectra hold the true value as often as they promise") {
  const std::vector<double> true_values{40.0, 60.0, 30.0, 0.02, 1.0, 0.0, 0.0};
  const std::vector<std::string> names{"k_inf", "k1", "k2", "tau1", "tau2"};
  const Spectrum exact =
      computed_spectrum(indentation_law("linear-2"), true_values, log_spaced(0.02, 50.0, 12));
  const FitConfig config =
      config_of("linear-2",
                stiffness("k_inf", "40 N/m") + ", " + stiffness("k1", "60 N/m") + ", " +
                    relaxation_time("tau1", "0.02 s") + ", " + stiffness("k2") + ", " +
                    relaxation_time("tau2", "1 s"),
                entry("a", kOscillation, absolute("0.5 N/m")), 1);
  constexpr int kSets = 200;
  int held = 0;
  double chi_square = 0.0;
  for (int set = 0; set < kSets; ++set) {
    const FitResult fit =
        run_fit(config, {DataSet(scattered_spectrum(exact, 0.5, static_cast<std::uint64_t>(set)))});
    chi_square += fit.chi_square / fit.degrees_of_freedom / kSets;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const ParameterResult& p = find(fit, names[i]);
      if ((!p.lower || *p.lower <= true_values[i]) && (!p.upper || true_values[i] <= *p.upper))
        ++held;
    }
  }
  INFO("held " << held << " of " << 5 * kSets << ", chi-square per degree " << chi_square);
  // 95 % within three standard deviations, if the five of a set came and went together.
  CHECK(std::abs(held / (5.0 * kSets) - 0.95) < 3.0 * std::sqrt(0.95 * 0.05 / kSets));
  // The mean of chi-square per degree, 19 degrees of freedom in each set.
  CHECK(std::abs(chi_square - 1.0) < 3.0 * std::sqrt(2.0 / 19.0 / kSets));
}

TEST_CASE("a fractional Kelvin-Voigt law from a power-law spectrum") {
  const std::vector<double> true_values{20.0, 35.0, 0.27, 0.0, 0.0};
  const Spectrum s = scattered_spectrum(computed_spectrum(indentation_law("linear-fkelvin_voigt"),
                                                          true_values, log_spaced(0.1, 100.0, 16)),
                                        0.4, 3);
  const FitResult fit = run_fit(config_of("linear-fkelvin_voigt",
                                          stiffness("k_inf") + ", " + stiffness("k1") + ", " +
                                              searched("alpha", "0.5", "0.01", "0.99"),
                                          entry("a", kOscillation, absolute("0.4 N/m"))),
                                {DataSet(s)});
  for (const auto& [name, value] :
       {std::pair{"k_inf", true_values[0]}, {"k1", true_values[1]}, {"alpha", true_values[2]}}) {
    const ParameterResult& p = find(fit, name);
    CAPTURE(name, p.estimate, p.standard_error.value());
    CHECK(p.verdict == Verdict::identified);
    CHECK(std::abs(p.estimate - value) < 3.0 * p.standard_error.value());
  }
  CHECK(fit.chi_square_p.value() > 0.001);
}

TEST_CASE("relaxation and oscillation identify together what each leaves open") {
  const std::string recorded = entry("slow", R"({"kind": "measured"})", absolute("1 mN"));
  const std::string oscillated = entry("fast", kOscillation, absolute("1 N/m"));
  const DataSet slow(slow_recording());
  const DataSet fast(fast_spectrum());
  const FitResult relaxation = run_fit(config_of("linear-1", kOneBranch, recorded), {slow});
  const FitResult oscillation = run_fit(config_of("linear-1", kOneBranch, oscillated), {fast});
  const FitResult joint =
      run_fit(config_of("linear-1", kOneBranch, recorded + ", " + oscillated), {slow, fast});
  CHECK(find(relaxation, "k_inf").verdict == Verdict::identified);
  CHECK(find(relaxation, "k1").verdict == Verdict::lower_only);
  CHECK(find(oscillation, "k_inf").verdict == Verdict::upper_only);
  for (const auto& [name, true_values] :
       {std::pair{"k_inf", kFast[0]}, {"k1", kFast[1]}, {"tau1", kFast[2]}}) {
    const ParameterResult& p = find(joint, name);
    CAPTURE(name, p.summary);
    CHECK(p.verdict == Verdict::identified);
    CHECK(p.lower.value() < true_values);
    CHECK(true_values < p.upper.value());
  }
  CHECK(joint.recordings.size() == 1);
  CHECK(joint.data.size() == 24);
  CHECK(joint.value_count == 41 + 24);
}

TEST_CASE("the shipped example is identified, and says that it is synthetic") {
  const FitConfig config =
      read_fit_config(std::string(TPM_TEST_SOURCE_DIR) + "/configs/oscillation_example/fit.json");
  CHECK_THAT(config.title, Contains("Synthetic"));
  const FitResult fit = run_fit(config);
  for (const ParameterResult& p : fit.parameters) CHECK(p.verdict == Verdict::identified);
  for (const FittedDatum& d : fit.data) CHECK(d.datum.provenance == Provenance::assumed);
  CHECK(fit.recordings.at(0).provenance == Provenance::assumed);
}

TEST_CASE("moduli answer an indentation law through A0/l0") {
  const std::vector<double> true_values{40.0, 60.0, 0.5, 0.0, 0.0};
  const Spectrum stiff =
      computed_spectrum(indentation_law("linear-1"), true_values, log_spaced(0.05, 5.0, 8));
  const std::string data =
      entry("a", kOscillation, absolute("0.1 kPa"), R"(, "stiffness_per_modulus": "12.56 mm")");
  const FitResult fit =
      run_fit(config_of("linear-1", kOneBranch, data), {DataSet(as_modulus(stiff, 12.56e-3))});
  CHECK_THAT(find(fit, "k1").estimate, WithinRel(60.0, 1e-6));
  const Json j = to_json(fit);
  CHECK(j["choices"][0]["protocol"] == "oscillation");
  CHECK(j["choices"][0]["stiffness_per_modulus_m"] == 0.01256);
  CHECK(j["data"][0]["quantity"] == "storage_modulus");
  CHECK(j["data"][0]["label"] == "storage at 0.05 Hz");
  CHECK(j["data"][0]["frequency_Hz"] == 0.05);
  CHECK(j["data"][0].contains("observed_Pa"));
  CHECK(j["data"][1]["quantity"] == "loss_modulus");
  CHECK_THAT(to_terminal_text(fit), Contains("storage at 0.05 Hz") && Contains("kPa"));
  const FitResult stiffness_fit =
      run_fit(config_of("linear-1", kOneBranch, entry("a", kOscillation, absolute("1 N/m"))),
              {DataSet(stiff)});
  CHECK(to_json(stiffness_fit)["data"][0].contains("predicted_N_per_m"));
}

TEST_CASE("a strip's moduli, and the depth that a spectrum was taken at") {
  const std::string strip = R"({"title": "computed", "law": {"name": "power-1", "reference": "0.2",
      "drive": "relative_length"}, "fixed": {"exponent": "2"}, "parameters": {
      "k_inf": {"start": "3 kPa", "lower": "0.1 kPa", "upper": "100 kPa"},
      "k1": {"start": "3 kPa", "lower": "0.1 kPa", "upper": "100 kPa"},
      "tau1": {"start": "2 s", "lower": "0.01 s", "upper": "100 s"}},
      "data": [{"dataset": "a", "noise": {"kind": "relative_to_datum", "relative": 0.02},
                "protocol": {"kind": "oscillation", "operating_depth": "0.1"}}],
      "starts": {"count": 3}})";
  const FitConfig config = parse_fit_config(parse_json(strip, "f.json"), "f.json");
  const std::vector<double> true_values{5e3, 8e3, 0.7, 2.0, 0.0, 0.0};
  const Spectrum s = computed_spectrum(*config.law, true_values, log_spaced(0.05, 5.0, 8), 0.1);
  const FitResult fit = run_fit(config, {DataSet(s)});
  CHECK_THAT(find(fit, "k_inf").estimate, WithinRel(5e3, 1e-6));
  CHECK_THAT(find(fit, "tau1").estimate, WithinRel(0.7, 1e-6));
  CHECK(to_json(fit)["choices"][0]["operating_depth"] == 0.1);
}

TEST_CASE("readings of a spectrum are left out and held out by their labels") {
  Spectrum s = computed_spectrum(indentation_law("linear-1"), {40.0, 60.0, 0.5, 0.0, 0.0},
                                 {0.1, 1.0, 10.0, 100.0});
  s.storage[0] *= 2.0;  // wrong, and not used
  s.storage_sd.assign(4, 0.5);
  s.loss_sd.assign(4, 0.25);
  const std::string more = R"(, "exclude": [{"label": "storage at 0.1 Hz"}],
                                "hold_out": [{"label": "loss at 10 Hz"}])";
  const ExperimentResiduals function(
      config_of("linear-1", kOneBranch, entry("a", kOscillation, R"({"kind": "per_row"})", more)),
      {DataSet(s)});
  CHECK(function.data().size() == 7);
  CHECK(function.value_count() == 6);
  CHECK(function.data()[0].sigma == 0.25);
  CHECK(function.data()[1].sigma == 0.5);
  const FitResult fit = fit_experiments(function);
  CHECK_THAT(find(fit, "k1").estimate, WithinRel(60.0, 1e-6));
  CHECK_THAT(fit.data[4].predicted, WithinRel(s.loss[2], 1e-6));
}

TEST_CASE("spectra that the configuration cannot answer are refused") {
  const Spectrum stiff = computed_spectrum(indentation_law("linear-1"), {40.0, 60.0, 0.5, 0.0, 0.0},
                                           {0.1, 1.0, 10.0, 100.0});
  const std::string noise = R"({"kind": "relative_to_datum", "relative": 0.1})";
  const auto with = [&](const std::string& more) {
    return config_of("linear-1", kOneBranch, entry("a", kOscillation, noise, more));
  };
  CHECK_THROWS_WITH(run_fit(with(""), {DataSet(as_modulus(stiff, 0.01))}),
                    Contains("spectrum 'a': moduli") && Contains("stiffness_per_modulus"));
  CHECK_THROWS_WITH(run_fit(with(R"(, "stiffness_per_modulus": "10 mm")"), {DataSet(stiff)}),
                    Contains("spectrum 'a': stiffnesses"));
  CHECK_THROWS_WITH(
      run_fit(config_of("linear-1", kOneBranch, entry("a", R"({"kind": "measured"})", noise)),
              {DataSet(stiff)}),
      Contains("under another protocol"));
  const auto refused = [&](const std::string& protocol, const std::string& sigma,
                           const std::string& more, const std::string& words) {
    CHECK_THROWS_WITH(
        config_of("linear-1", kOneBranch, entry("a", protocol, absolute(sigma), more)),
        Contains(words));
  };
  refused(R"({"kind": "oscillation", "operating_depth": "2 furlong"})", "1 N/m", "",
          "/data/0/protocol/operating_depth");
  refused(R"({"kind": "oscillation", "operating_depth": "-2 mm"})", "1 N/m", "", "below 0");
  refused(R"({"kind": "measured", "operating_depth": "2 mm"})", "1 mN", "",
          "is no key of the kind 'measured'");
  refused(R"({"kind": "measured"})", "1 mN", R"(, "stiffness_per_modulus": "1 mm")", "measured");
  refused(kOscillation, "1 kPa", R"(, "stiffness_per_modulus": "0 mm")", "expected above 0 m");
  refused(kOscillation, "1 kPa", "", "/data/0/noise/absolute");
  refused(kOscillation, "1 N/m", R"(, "from": "1 s")", "without a recording");
}

TEST_CASE("the figure of a spectrum holds its readings and the law's answer to them") {
  const FitResult fit =
      run_fit(read_fit_config(TPM_TEST_SOURCE_DIR "/configs/oscillation_example/fit.json"));
  const Figure figure = spectrum_figure(fit, 1);
  REQUIRE(figure.panels.size() == 1);
  const Panel& panel = figure.panels.front();
  CHECK((panel.x.logarithmic && panel.y.logarithmic));
  CHECK(panel.y.unit == "N/m");
  REQUIRE(panel.series.size() == 4);
  const std::size_t readings = panel.series[0].x.size() + panel.series[1].x.size();
  CHECK(readings == fit.data.size());
  for (const std::size_t part : {0U, 1U}) {
    const Series& data = panel.series[part];
    const Series& law = panel.series[part + 2];
    CHECK(law.x.front() < data.x.front());
    CHECK(law.x.back() > data.x.back());
    // k_inf + k1 (w tau)^2/(1 + (w tau)^2) and k1 w tau/(1 + (w tau)^2)
    for (std::size_t i = 0; i < law.x.size(); ++i) {
      const double z = 2.0 * std::numbers::pi * law.x[i] * fit.best.natural[2];
      const double k1 = fit.best.natural[1] / (1.0 + z * z);
      CHECK_THAT(law.y[i], WithinRel(part == 0 ? fit.best.natural[0] + k1 * z * z : k1 * z, 1e-12));
    }
  }
  CHECK_NOTHROW(to_json(std::vector<Figure>{figure}));
  CHECK_THROWS_WITH(spectrum_figure(fit, 0), Contains("no spectrum"));
}

TEST_CASE("error bars of a spectrum are those of its noise, on the readings' own scale") {
  const std::vector<double> true_values{40.0, 60.0, 0.5, 0.0, 0.0};
  const Spectrum exact =
      computed_spectrum(indentation_law("linear-1"), true_values, log_spaced(0.05, 5.0, 8));
  const auto bars = [&](const std::string& noise) {
    const FitResult fit =
        run_fit(config_of("linear-1", kOneBranch, entry("a", kOscillation, noise)), {exact});
    std::vector<double> relative;
    for (const FittedDatum& d : fit.data) relative.push_back(d.reading_sd / *d.datum.value);
    const Figure figure = spectrum_figure(fit, 0);
    const Series& storage = figure.panels.front().series.front();
    REQUIRE(storage.sd.size() == 8);
    for (std::size_t i = 0; i < 8; ++i) {
      CHECK_THAT(storage.sd[i] / storage.y[i], WithinRel(relative[2 * i], 1e-9));
    }
    return relative;
  };
  // A standard deviation of 0.05 in the logarithm is 5 % of each reading.
  for (const double sd : bars(R"({"kind": "log", "relative": 0.05, "scale": "known"})")) {
    CHECK_THAT(sd, WithinRel(0.05, 1e-9));
  }
  for (const double sd : bars(R"({"kind": "relative_to_datum", "relative": 0.05,
                                  "scale": "known"})")) {
    CHECK_THAT(sd, WithinRel(0.05, 1e-9));
  }
}
