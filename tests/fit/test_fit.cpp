// The fit engine: derivatives of every cost function, the liver relaxation problem, verdicts,
// noise conventions, bands, recordings, and what happens when a simulation fails.
#include <ceres/cost_function.h>
#include <ceres/gradient_checker.h>

#include <fmt/format.h>
#include <unistd.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "expected_values.hpp"
#include "fitted_parameter.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/fit.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

std::string config_path(const std::string& name) {
  return std::string(TPM_TEST_SOURCE_DIR) + "/configs/" + name;
}

FitConfig liver_relaxation_config() {
  return read_fit_config(config_path("liver_relaxation.json"));
}

/// A residual function as a Ceres cost in natural parameters divided by a reference point.
class NaturalCost final : public ceres::CostFunction {
 public:
  NaturalCost(const ResidualFunction& function, std::vector<double> scale)
      : function_(function), scale_(std::move(scale)) {
    set_num_residuals(static_cast<int>(function.residual_count()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(scale_.size()));
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    std::vector<double> natural(scale_.size());
    for (std::size_t i = 0; i < natural.size(); ++i) natural[i] = x[0][i] * scale_[i];
    Eigen::VectorXd r;
    RowMatrix j;
    const bool want = jacobians != nullptr && jacobians[0] != nullptr;
    if (!function_.evaluate(natural, r, want ? &j : nullptr)) return false;
    std::copy(r.data(), r.data() + r.size(), residuals);
    if (want) {
      for (Eigen::Index i = 0; i < j.rows(); ++i) {
        for (Eigen::Index k = 0; k < j.cols(); ++k) {
          jacobians[0][i * j.cols() + k] = j(i, k) * scale_[static_cast<std::size_t>(k)];
        }
      }
    }
    return true;
  }

 private:
  const ResidualFunction& function_;
  std::vector<double> scale_;
};

/// Ceres' GradientChecker at random points of the box (away from its far ends, where the forces no
/// longer depend on anything).
void check_gradient_by_ceres(const FitConfig& config, std::uint64_t seed) {
  const ExperimentResiduals function(config);
  Random random(seed);
  for (int point = 0; point < 4; ++point) {
    std::vector<double> natural;
    for (const EstimatedParameter& p : config.parameters) {
      natural.push_back(p.fit.name == "eta1" ? std::pow(10.0, 4.8 + 1.2 * random.uniform())
                                             : p.fit.start * (0.5 + 1.5 * random.uniform()));
    }
    const NaturalCost cost(function, natural);
    ceres::NumericDiffOptions options;
    // Small enough not to reach across the kinks of a robust loss or of a band's edge.
    options.ridders_relative_initial_step_size = 1e-4;
    const std::vector<const ceres::Manifold*> none{nullptr};
    const ceres::GradientChecker checker(&cost, &none, options);
    const std::vector<double> one(natural.size(), 1.0);
    const double* block = one.data();
    ceres::GradientChecker::ProbeResults results;
    const bool good = checker.Probe(&block, 1e-4, &results);
    INFO(results.error_log);
    CHECK(good);
  }
}

std::filesystem::path temporary_folder() {
  static int count = 0;
  auto folder = std::filesystem::temp_directory_path() /
                ("tpm_test_fit_" + std::to_string(getpid()) + "_" + std::to_string(count++));
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace

TEST_CASE("derivatives of every cost function pass Ceres' gradient checker") {
  std::uint64_t seed = 1;
  for (const NoiseKind kind : {NoiseKind::relative_to_datum, NoiseKind::absolute,
                               NoiseKind::combined, NoiseKind::log, NoiseKind::relative_to_model}) {
    FitConfig config = liver_relaxation_config();
    config.data[0].noise = {kind, kind == NoiseKind::relative_to_datum ? 0.0 : 0.01, 0.1, true};
    CAPTURE(noise_kind_name(kind));
    check_gradient_by_ceres(config, seed++);
  }
  for (const Loss loss : {Loss::huber, Loss::cauchy}) {
    FitConfig config = liver_relaxation_config();
    config.loss = {loss, 1.0};
    CAPTURE(loss_name(loss));
    check_gradient_by_ceres(config, seed++);
  }
  // Bands; at random points the model lies outside most of them.
  for (const char* dataset : {"amy_creep", "evren_static"}) {
    FitConfig config = liver_relaxation_config();
    config.data[0].dataset = dataset;
    config.data[0].protocol = {};
    config.data[0].protocol.kind = std::string(dataset) == "amy_creep"
                                       ? ProtocolChoice::Kind::creep
                                       : ProtocolChoice::Kind::static_;
    CAPTURE(dataset);
    check_gradient_by_ceres(config, seed++);
  }
  FitConfig frozen = liver_relaxation_config();
  frozen.tension = TensionRule::frozen_at_peak();
  check_gradient_by_ceres(frozen, seed++);
  FitConfig separate = read_fit_config(config_path("liver_separate_moduli.json"));
  check_gradient_by_ceres(separate, seed++);
}

TEST_CASE("derivatives through CVODES equal those through the closed form") {
  // Differences of an adaptive integrator are noise, so its sensitivities are compared with the
  // exact ones instead.
  for (const char* dataset : {"evren_relaxation", "amy_creep"}) {
    FitConfig config = liver_relaxation_config();
    if (std::string(dataset) == "amy_creep") {
      config.data[0].dataset = dataset;
      config.data[0].protocol = {};
      config.data[0].protocol.kind = ProtocolChoice::Kind::creep;
    }
    const ExperimentResiduals exact(config);
    config.model = "cvodes";
    const ExperimentResiduals integrated(config);
    for (const double eta1 : {5.0, 1e4, 1e6}) {
      const std::vector<double> natural{9e3, eta1, 0.025};
      Eigen::VectorXd r;
      RowMatrix a;
      RowMatrix b;
      REQUIRE(exact.evaluate(natural, r, &a));
      REQUIRE(integrated.evaluate(natural, r, &b));
      for (Eigen::Index j = 0; j < a.cols(); ++j) {
        const double scale = natural[static_cast<std::size_t>(j)];
        CHECK((a.col(j) - b.col(j)).cwiseAbs().maxCoeff() * scale < 1e-6);
      }
    }
  }
}

TEST_CASE("liver relaxation: minima, agreement of the starts, verdicts") {
  const FitResult fit = run_fit(liver_relaxation_config());
  CHECK(fit.starts_run == 50);
  CHECK(fit.starts_failed == 0);
  CHECK(fit.starts_agreeing >= 20);
  int listed = 0;
  for (const DistinctMinimum& m : fit.minima) listed += m.starts;
  CHECK(listed == fit.starts_run);
  CHECK(fit.value_count == 8);
  CHECK(fit.degrees_of_freedom == 5);
  CHECK_THAT(fit.chi_square, WithinRel(fit.best.deviance, 1e-12));
  // x runs to its bound and is one-sided, E and eta1 are identified, the paper's eta1 is excluded
  CHECK(find(fit, "spacing").at_upper_bound);
  CHECK(find(fit, "spacing").verdict == Verdict::lower_only);
  CHECK(find(fit, "E").verdict == Verdict::identified);
  CHECK(find(fit, "eta1").verdict == Verdict::identified);
  CHECK(*find(fit, "eta1").lower > 1000.0 * 5.0);
  REQUIRE(fit.hypotheses.size() == 3);
  CHECK(fit.hypotheses[0].excluded);
  CHECK(fit.hypotheses[0].summary.find("is excluded by these data") != std::string::npos);
  CHECK_FALSE(fit.hypotheses[1].excluded);  // x = 30 mm
  // each limit stands where the re-optimised deviance has risen by the 95 % point of chi-square(1)
  const ExperimentResiduals function(fit.config);
  std::vector<FitParameter> parameters;
  for (const auto& p : fit.config.parameters) parameters.push_back(p.fit);
  for (std::size_t i = 0; i < 3; ++i) {
    for (const auto& limit : {fit.parameters[i].lower, fit.parameters[i].upper}) {
      if (!limit) continue;
      FixedMask fixed(3, false);
      fixed[i] = true;
      std::vector<double> at = fit.best.natural;
      at[i] = *limit;
      CHECK_THAT(minimise(function, parameters, at, fixed).deviance - fit.best.deviance,
                 WithinAbs(3.841459, 1e-4));
    }
  }
}

TEST_CASE("the noise convention moves x, as docs/data say") {
  FitConfig config = liver_relaxation_config();
  config.profiles = false;
  config.hypotheses.clear();
  config.data[0].noise = {NoiseKind::log, 0.0, 0.1, true};
  CHECK_THAT(find(run_fit(config), "spacing").estimate,
             test::expected("liver_relaxation.spacing_with_log_noise"));
  config.data[0].noise.kind = NoiseKind::relative_to_model;
  CHECK_THAT(find(run_fit(config), "spacing").estimate,
             test::expected("liver_relaxation.spacing_with_noise_relative_to_model"));
}

TEST_CASE("results do not depend on the order of runs and repeat for a seed; seed 0 is a seed") {
  FitConfig config = liver_relaxation_config();
  config.seed = 0;
  const std::string first = to_text(to_json(run_fit(config)));
  config.seed = 1;
  const std::string other = to_text(to_json(run_fit(config)));
  config.seed = 0;
  CHECK(to_text(to_json(run_fit(config))) == first);
  CHECK(other != first);
}

TEST_CASE("a held-out depth is predicted, not fitted") {
  FitConfig config = liver_relaxation_config();
  Selector depth;
  depth.depth_m = 0.008;
  config.data[0].hold_out.push_back(depth);
  const FitResult fit = run_fit(config);
  CHECK(fit.value_count == 6);
  int held_out = 0;
  for (const FittedDatum& d : fit.data) {
    if (!d.datum.held_out) continue;
    ++held_out;
    CHECK(d.predicted_sd.has_value());
  }
  CHECK(held_out == 2);
  // the same minimum as a fit that has never seen the depth
  FitConfig without = liver_relaxation_config();
  without.data[0].exclude.push_back(depth);
  CHECK_THAT(run_fit(without).best.deviance, WithinRel(fit.best.deviance, 1e-10));
}

TEST_CASE("CVODES and the closed form give the same fit") {
  FitConfig config = liver_relaxation_config();
  config.starts = 1;
  config.profiles = false;
  config.hypotheses.clear();
  config.parameters[1].fit.start = 1e5;
  const FitResult exact = run_fit(config);
  config.model = "cvodes";
  const FitResult integrated = run_fit(config);
  CHECK_THAT(integrated.best.deviance, WithinRel(exact.best.deviance, 1e-7));
  CHECK_THAT(integrated.best.natural[0], WithinRel(exact.best.natural[0], 1e-5));
  CHECK_THAT(integrated.best.natural[1], WithinRel(exact.best.natural[1], 1e-5));
}

TEST_CASE("a band costs nothing inside and a normal tail outside") {
  CHECK(band_residual(0.1, 1.0, 2.0, 1.5).r == 0.0);
  CHECK_THAT(band_residual(0.1, 1.0, 2.0, 2.3).r, WithinRel(3.0, 1e-12));
  CHECK_THAT(band_residual(0.1, 1.0, 2.0, 0.9).r, WithinRel(-1.0, 1e-12));
  const FitResult fit = run_fit(read_fit_config(config_path("liver_all.json")));
  CHECK(fit.value_count == 8);
  CHECK(fit.band_count == 6);
  CHECK(fit.degrees_of_freedom == 5);  // bands do not count
}

TEST_CASE("E1, E2 and E' apart: what the data cannot tell is said") {
  const FitResult fit = run_fit(read_fit_config(config_path("liver_separate_moduli.json")));
  CHECK(find(fit, "E1").at_lower_bound);
  CHECK(find(fit, "E1").verdict == Verdict::upper_only);
  CHECK(find(fit, "E2").verdict == Verdict::identified);
}

TEST_CASE("a parameter that does nothing is flat") {
  FitConfig config = liver_relaxation_config();
  config.data[0].protocol = {};
  config.data[0].protocol.kind = ProtocolChoice::Kind::static_;
  config.data[0].dataset = "evren_static";
  config.hypotheses.clear();
  const FitResult fit = run_fit(config);
  CHECK(find(fit, "eta1").verdict == Verdict::flat);
  CHECK_FALSE(fit.covariance.full_rank);
  CHECK(find(fit, "eta1").summary.find("undetermined") != std::string::npos);
}

TEST_CASE("a measured recording is fitted along its own displacement") {
  // A synthetic recording (said so in its header) made by the model itself.
  const auto folder = temporary_folder();
  TpmParameters true_values;
  true_values.E1_Pa = true_values.E2_Pa = true_values.Eprime_Pa = 9e3;
  true_values.eta1_Pa_s = 4e4;
  true_values.spacing_m = 0.02;
  std::vector<double> t;
  std::vector<double> u;
  for (int i = 0; i <= 200; ++i) {
    t.push_back(0.1 * i);
    u.push_back(i < 40 ? 1e-3 * 0.1 * i * (1.0 + 0.2 * std::sin(0.7 * i)) : 5e-3);
  }
  const auto model = make_model("closed_form");
  const Response r = model->respond(measured_history(Drive::displacement, t, u), t,
                                    to_vector(true_values), Want::values);
  std::string csv = "time_s,depth_mm,force_N\n";
  for (std::size_t i = 0; i < t.size(); ++i) {
    csv += fmt::format("{},{},{}\n", t[i], u[i] * 1e3, r.value[static_cast<Eigen::Index>(i)]);
  }
  write_file(folder / "synthetic.csv", csv);
  write_file(folder / "synthetic.json", R"({
    "id": "synthetic", "title": "Synthetic ramp and hold", "kind": "recording",
    "specimen": "none: computed", "citation": "computed by a test", "observable": "contact_force", "provenance": "derived",
    "columns": {"time_s": {"quantity": "time", "unit": "s"},
                "depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
                "force_N": {"quantity": "contact_force", "unit": "N"}}})");
  FitConfig config = liver_relaxation_config();
  config.folder = folder;
  config.hypotheses.clear();
  config.profiles = false;
  config.data[0].dataset = "synthetic.csv";
  config.data[0].protocol = {};
  config.data[0].protocol.kind = ProtocolChoice::Kind::measured;
  config.data[0].noise = {NoiseKind::absolute, 0.01, 0.0, true};
  const FitResult fit = run_fit(config);
  CHECK_THAT(find(fit, "E").estimate, WithinRel(9e3, 1e-6));
  CHECK_THAT(find(fit, "eta1").estimate, WithinRel(4e4, 1e-6));
  CHECK_THAT(find(fit, "spacing").estimate, WithinRel(0.02, 1e-6));
  std::filesystem::remove_all(folder);
}

TEST_CASE("a simulation that fails never looks like a perfect fit") {
  class Failing final : public ResidualFunction {
   public:
    [[nodiscard]] Eigen::Index residual_count() const override { return 1; }
    [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                                RowMatrix* jacobian) const override {
      if (always || natural[0] > 5.0) return false;
      residual = Eigen::VectorXd::Constant(1, natural[0] - 7.0);  // pulls into the failing region
      if (jacobian != nullptr) *jacobian = RowMatrix::Ones(1, 1);
      return true;
    }
    bool always = false;
  };
  FitParameter p;
  p.name = "p";
  p.unit = parse_unit("", "test");
  p.scale = Scale::linear;
  p.start = 1.0;
  p.lower = 0.0;
  p.upper = 10.0;
  const std::vector<FitParameter> parameters{p};
  Failing function;
  const Minimum m = minimise(function, parameters, std::vector<double>{1.0});
  CHECK(m.usable);
  CHECK(m.natural[0] <= 5.0);
  CHECK(m.deviance >= 4.0);
  function.always = true;
  CHECK_FALSE(minimise(function, parameters, std::vector<double>{1.0}).usable);
  CHECK_THROWS_WITH(
      fit_residuals(function, {p}, {{1.0}, {2.0}, {3.0}}, Threshold{}, false),
      Catch::StartsWith("fit: none of 3 starts ended in a point that can be evaluated; expected "));
}

TEST_CASE("robust losses hold an outlier down") {
  FitConfig config = liver_relaxation_config();
  config.profiles = false;
  config.hypotheses.clear();
  const double plain = find(run_fit(config), "E").estimate;
  config.loss = {Loss::cauchy, 1.0};
  const FitResult fit = run_fit(config);
  const double robust = find(fit, "E").estimate;
  REQUIRE(fit.remarks.size() == 2);
  CHECK(fit.remarks[1].code == "loss_without_likelihood");
  CHECK(robust < plain);  // the 8 mm peak, 2.7 sigma high, pulls less
}

TEST_CASE("mistakes in a configuration are named") {
  const auto refuse = [](const char* find_text, const char* replace_text, const char* message) {
    std::string text = read_file(config_path("liver_relaxation.json"));
    const auto at = text.find(find_text);
    REQUIRE(at != std::string::npos);
    text.replace(at, std::string(find_text).size(), replace_text);
    CHECK_THROWS_WITH(parse_fit_config(parse_json(text, "f.json"), "f.json"),
                      Catch::Contains(message) && Catch::StartsWith("f.json"));
  };
  refuse("\"12 kPa\"", "\"12 mm\"", "/parameters/E/start: 'mm' is a unit of length");
  refuse("\"12 kPa\"", "\"nan kPa\"", "'nan' is not a finite number");
  refuse("\"0.1 kPa\"", "\"-1 kPa\"", "parameter 'E': bounds");
  refuse("\"0.1 kPa\"", "\"13 kPa\"", "start 12000 (SI) is outside the bounds");
  refuse("\"starts\"", "\"satrts\"", "/satrts: unknown key");
  refuse("\"4 mm/s\"", "\"4 mm\"", "/data/0/protocol/rate");
  refuse("\"4 mm/s\"", "\"0 mm/s\"", "0 m/s; expected above 0 m/s");
  refuse("\"relative\": 0.1", "\"absolute\": \"0.1 N\"", "needs 'relative'");
  refuse("\"relative\": 0.1", "\"relative\": -0.1",
         "/data/0/noise/relative: -0.1; expected above 0");
  refuse("[\"E1\", \"E2\", \"Eprime\"]", "[\"E1\", \"E2\", \"eta1\"]", "different dimensions");
  refuse("\"A0\": \"12.56 mm^2\"", "\"E1\": \"12 kPa\"", "is set by 'E' and by 'fixed'");
  refuse("{\"eta1\": \"5 Pa s\"}", "{\"eta2\": \"5 Pa s\"}",
         "'eta2' is not an estimated parameter");
  FitConfig config = liver_relaxation_config();
  config.data[0].dataset = "no_such_curve";
  CHECK_THROWS_AS(run_fit(config), Error);
  config = liver_relaxation_config();
  config.data[0].exclude.push_back(Selector{});
  CHECK_THROWS_WITH(run_fit(config), Catch::Contains("no datum is left"));
}
