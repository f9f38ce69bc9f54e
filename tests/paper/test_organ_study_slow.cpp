// What the fits of the committed report rest on, evaluated again, and parameters that come back.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/paper/organ_study.hpp"

using namespace tpm;
using namespace tpm::paper;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
namespace fs = std::filesystem;

namespace {

const fs::path kSource = TPM_TEST_SOURCE_DIR;

OrganStudyConfig shipped_study() {
  return read_organ_study(kSource / "configs" / "organ_experiments.json");
}

std::vector<double> estimates_in(const Json& fit) {
  std::vector<double> values;
  for (const Json& p : fit.at("parameters")) values.push_back(p.at("estimate_SI"));
  return values;
}

double deviance_at(const ExperimentResiduals& function, std::span<const double> natural) {
  Eigen::VectorXd residual;
  REQUIRE(function.evaluate(natural, residual, nullptr));
  return residual.squaredNorm() - function.offset();
}

}  // namespace

TEST_CASE("the committed fits have the chi-square that they state, and none nearby is lower") {
  const OrganStudyConfig config = shipped_study();
  const Json report = read_json(kSource / "reports" / "organ" / "experiments.json");
  std::size_t checked = 0;
  for (std::size_t f = 0; f < config.fits.size(); ++f) {
    for (std::size_t t = 0; t < config.tissues.size(); ++t) {
      const Json& stored = report.at("fits").at(f * config.tissues.size() + t);
      CAPTURE(stored.at("fit"), stored.at("tissue"));
      REQUIRE(stored.at("fit") == config.fits[f].name);
      if (stored.at("result").is_null()) continue;
      const ExperimentResiduals function(config.fits[f].configs[t]);
      const std::vector<double> best = estimates_in(stored.at("result"));
      const double chi_square = stored.at("result").at("chi_square");
      const double here = deviance_at(function, best);
      CHECK_THAT(here, WithinRel(chi_square, 1e-3) || WithinAbs(chi_square, 1e-6));
      for (std::size_t i = 0; i < best.size(); ++i) {
        for (const double factor : {0.97, 1.03}) {
          std::vector<double> beside = best;
          const FitParameter& p = config.fits[f].configs[t].parameters[i].fit;
          beside[i] = std::clamp(best[i] * factor, p.lower, p.upper);
          Eigen::VectorXd residual;
          if (!function.evaluate(beside, residual, nullptr)) continue;
          CHECK(residual.squaredNorm() > here * (1.0 - 1e-4) - 1e-6);
          ++checked;
        }
      }
    }
  }
  CHECK(checked > 50);
}

namespace {

constexpr const char* kScene = R"({"organ": {"kind": "liver", "count": 40, "spacing": "20 mm"}})";

/// One of the study's fits with an organ of a few spheres.
FitConfig small_fit(const std::string& name) {
  const OrganStudyConfig study = shipped_study();
  for (const StudyFit& fit : study.fits) {
    if (fit.name != name) continue;
    FitConfig config = fit.configs.back();
    config.organ = std::make_shared<Tissue>(parse_tissue(parse_json(kScene, "scene"), "scene", {}));
    config.hypotheses.clear();
    for (EstimatedParameter& p : config.parameters) {
      if (p.fit.name == "spacing") p.fit.lower = 0.015;
    }
    return config;
  }
  throw std::out_of_range(name);
}

/// Readings of the shipped data set at the same conditions, with what the model answers as values.
PointSet answered(PointSet points, const ExperimentResiduals& function, std::size_t choice,
                  std::span<const double> true_values) {
  const Eigen::VectorXd answers = function.predict(true_values, nullptr);
  std::size_t next = 0;
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    if (function.data()[i].choice != choice) continue;
    Datum& d = points.data.at(next++);
    d.value = answers[static_cast<Eigen::Index>(i)];
    d.lower = d.upper = std::nullopt;
  }
  return points;
}

}  // namespace

TEST_CASE("an organ's parameters come back from values of all three experiments at once") {
  FitConfig config = small_fit("all");
  config.profiles = false;
  const std::vector<double> true_values{2.1e4, 1.4e5, 0.028};
  const std::vector<DataSet> shipped_data = load_data(config);
  const ExperimentResiduals function(config, shipped_data);
  std::vector<DataSet> data;
  for (std::size_t i = 0; i < shipped_data.size(); ++i) {
    data.emplace_back(answered(std::get<PointSet>(shipped_data[i]), function, i, true_values));
  }
  const FitResult fit = run_fit(config, data);
  CHECK(fit.value_count == 14);
  CHECK(fit.chi_square < 1e-5);
  for (std::size_t i = 0; i < true_values.size(); ++i) {
    CAPTURE(i);
    CHECK_THAT(fit.best.natural[i], WithinRel(true_values[i], 1e-2));
  }
}

TEST_CASE("static values of an organ tell E and x and say that they cannot tell eta1") {
  const FitConfig config = small_fit("static");
  const std::vector<double> true_values{2.1e4, 1.4e5, 0.020};
  const std::vector<DataSet> shipped_data = load_data(config);
  const ExperimentResiduals function(config, shipped_data);
  const std::vector<DataSet> data{
      answered(std::get<PointSet>(shipped_data.front()), function, 0, true_values)};
  const FitResult fit = run_fit(config, data);
  CHECK(fit.chi_square < 1e-5);
  CHECK_THAT(fit.best.natural[0], WithinRel(true_values[0], 0.02));
  CHECK(fit.parameters[0].lower.value() < true_values[0]);
  CHECK(fit.parameters[0].upper.value() > true_values[0]);
  CHECK(fit.parameters[1].verdict == Verdict::flat);
}

TEST_CASE("bands about what an organ answers hold its parameters in their intervals") {
  const FitConfig config = small_fit("creep");
  const std::vector<double> true_values{2.1e4, 1.4e5, 0.028};
  const std::vector<DataSet> shipped_data = load_data(config);
  const ExperimentResiduals function(config, shipped_data);
  PointSet points = answered(std::get<PointSet>(shipped_data.front()), function, 0, true_values);
  for (Datum& d : points.data) {
    d.lower = 0.95 * *d.value;
    d.upper = 1.05 * *d.value;
    d.value = std::nullopt;
  }
  const FitResult fit = run_fit(config, std::vector<DataSet>{points});
  CHECK(fit.chi_square < 1e-6);
  for (std::size_t i = 0; i < true_values.size(); ++i) {
    CAPTURE(i, fit.parameters[i].summary);
    CHECK(fit.parameters[i].lower.value_or(0.0) < true_values[i]);
    CHECK(fit.parameters[i].upper.value_or(1e12) > true_values[i]);
  }
}
