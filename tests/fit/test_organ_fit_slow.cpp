// Fits with an organ, small enough for a test.
#include <catch2/catch.hpp>

#include "tpm/fit/fit.hpp"
#include "tpm/organ/scene/organ_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;

namespace {

/// configs/organ_relaxation.json with an organ of a few spheres.
FitConfig small_config() {
  FitConfig config =
      read_fit_config(std::string(TPM_TEST_SOURCE_DIR) + "/configs/organ_relaxation.json");
  const char* const scene = R"({"organ": {"kind": "liver", "count": 40, "spacing": "20 mm"}})";
  config.organ = std::make_shared<Tissue>(parse_tissue(parse_json(scene, "scene"), "scene", {}));
  config.hypotheses.clear();
  config.profiles = false;
  for (EstimatedParameter& p : config.parameters) {
    if (p.fit.name == "spacing") p.fit.lower = 0.015;
  }
  return config;
}

std::vector<FitParameter> fit_parameters(const FitConfig& config) {
  std::vector<FitParameter> parameters;
  for (const EstimatedParameter& p : config.parameters) parameters.push_back(p.fit);
  return parameters;
}

/// The same residuals without the surrogate.
class WithoutSurrogate final : public ResidualFunction {
 public:
  explicit WithoutSurrogate(const ResidualFunction& function) : function_(function) {}
  [[nodiscard]] Eigen::Index residual_count() const override { return function_.residual_count(); }
  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    return function_.evaluate(natural, residual, jacobian);
  }

 private:
  const ResidualFunction& function_;
};

}  // namespace

TEST_CASE("an organ's parameters come back from its own answers") {
  const std::vector<double> true_values{2.1e4, 1.4e5, 0.033};
  ExperimentResiduals function(small_config());
  const Eigen::VectorXd answers = function.predict(true_values, nullptr);
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    function.set_value(i, answers[static_cast<Eigen::Index>(i)]);
  }
  const FitResult fit = fit_experiments(function);
  CHECK(fit.chi_square < 1e-6);
  CHECK(fit.starts_failed == 0);
  for (std::size_t i = 0; i < true_values.size(); ++i) {
    CAPTURE(i);
    CHECK_THAT(fit.best.natural[i], WithinRel(true_values[i], 5e-3));
  }
}

TEST_CASE("the search that a surrogate leads ends where Ceres does without") {
  const FitConfig config = small_config();
  const ExperimentResiduals function(config);
  const std::vector<FitParameter> parameters = fit_parameters(config);
  const FitResult fit = fit_experiments(function);
  const Minimum alone =
      minimise(WithoutSurrogate(function), parameters, std::vector<double>{2e4, 1e5, 0.04});
  REQUIRE(alone.usable);
  CHECK_THAT(fit.best.deviance, WithinRel(alone.deviance, 1e-4));
  CHECK_THAT(fit.best.natural[0], WithinRel(alone.natural[0], 1e-2));
}
