// The check of derivatives: correct ones pass, falsified ones fail, and what it cannot do is said.
#include <catch2/catch.hpp>
#include <cmath>

#include "gradient_check.hpp"
#include "statistics_problems.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"

using namespace tpm;
using namespace tpm::fit;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A decay whose Jacobian or values are falsified.
class Falsified final : public ResidualFunction {
 public:
  double jacobian_factor = 1.0;  ///< of the entry below
  Eigen::Index row = 3, column = 1;
  double noise = 0.0;  ///< amplitude of a rough function of the parameters, relative
  bool broken_away_from_nominal = false;

  Eigen::Index residual_count() const override { return 12; }
  bool evaluate(std::span<const double> p, Eigen::VectorXd& r, RowMatrix* j) const override {
    if (broken_away_from_nominal && std::abs(p[0] - 3.0) > 1.0) return false;
    r.resize(12);
    if (j != nullptr) j->resize(12, 2);
    for (Eigen::Index i = 0; i < 12; ++i) {
      double d[2];
      const double f = decay(0.5 * static_cast<double>(i), p, d);
      const double rough = std::sin(1e12 * (p[0] + 1.7 * p[1]) + static_cast<double>(i));
      r[i] = (f * (1.0 + noise * rough) - 1.0) / 0.1;
      if (j != nullptr) j->row(i) << d[0] / 0.1, d[1] / 0.1;
    }
    if (j != nullptr) (*j)(row, column) *= jacobian_factor;
    return true;
  }
};

std::vector<FitParameter> narrow_decay() {
  return {parameter("amplitude", Scale::log, 3.0, 0.5, 20.0),
          parameter("tau", Scale::log, 2.0, 0.5, 10.0)};
}

}  // namespace

TEST_CASE("a correct Jacobian passes the gradient check, with a noise floor, too") {
  for (const double noise : {0.0, 1e-12, 1e-9, 1e-7, 1e-6}) {
    Falsified function;
    function.noise = noise;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const GradientCheck check = check_gradient(function, narrow_decay(), {3, seed, 3e-4});
      INFO(to_terminal_text(check));
      CAPTURE(noise);
      CHECK(check.passed());
      CHECK(check.points.size() == 4);
      CHECK(check.points[0].natural == std::vector<double>{3.0, 2.0});
      CHECK(check.undecided == 0);
    }
  }
}

TEST_CASE("a Jacobian that is wrong by 0.1 % in one entry fails the gradient check") {
  for (const double noise : {0.0, 1e-12, 1e-9}) {
    for (const double factor : {1.001, 0.999, -1.0, 0.0, 1.1}) {
      for (Eigen::Index column : {0, 1}) {
        Falsified function;
        function.jacobian_factor = factor;
        function.column = column;
        function.noise = noise;
        const GradientCheck check = check_gradient(function, narrow_decay());
        INFO(to_terminal_text(check));
        CAPTURE(factor, noise);
        CHECK_FALSE(check.passed());
        const ParameterGradient& g = check.points[0].parameters[static_cast<std::size_t>(column)];
        CHECK(g.verdict == GradientVerdict::wrong);
        CHECK(g.residual == 3);
      }
    }
  }
}

TEST_CASE("the gradient check works at bounds, without influence, and says what it cannot do") {
  Falsified function;
  std::vector<FitParameter> at_bound = narrow_decay();
  at_bound[0].lower = at_bound[0].start;
  at_bound[1].upper = at_bound[1].start;
  CHECK(check_gradient(function, at_bound).passed());

  const CurveResiduals flat(straight_line, {{0, 0, 0}, {1, 2, 3}, 1.0, {}});
  const GradientCheck no_slope = check_gradient(flat, line_parameters());
  INFO(to_terminal_text(no_slope));
  CHECK(no_slope.passed());
  CHECK(no_slope.undecided == 0);

  function.noise = 0.3;
  const GradientCheck rough = check_gradient(function, narrow_decay());
  CHECK_FALSE(rough.passed());
  CHECK(rough.undecided > 4);

  const Json j = to_json(check_gradient(Falsified(), narrow_decay()));
  CHECK(j["passed"] == true);
  CHECK(j["points"].size() == 4);
  CHECK(j["points"][1]["parameters"][1]["verdict"] == "agrees");

  Falsified narrow;
  narrow.broken_away_from_nominal = true;
  CHECK_THROWS_WITH(check_gradient(narrow, narrow_decay()), Contains("random points"));
}

TEST_CASE("the derivatives of the liver relaxation fit pass the gradient check") {
  const FitConfig config =
      read_fit_config(std::string(TPM_TEST_SOURCE_DIR) + "/configs/liver_relaxation.json");
  const ExperimentResiduals function(config);
  std::vector<FitParameter> parameters;
  for (const EstimatedParameter& p : config.parameters) parameters.push_back(p.fit);
  const GradientCheck check = check_gradient(function, parameters, {5, 1, 3e-4});
  INFO(to_terminal_text(check));
  CHECK(check.passed());
  CHECK(check.undecided == 0);
}
