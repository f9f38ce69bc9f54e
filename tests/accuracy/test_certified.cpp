// NIST's certified problems beyond what `tpm accuracy verify` runs: random starts, and profile
// intervals against certified standard deviations.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/accuracy/verify/certified_fit.hpp"

using namespace tpm;
using namespace tpm::accuracy;
using Catch::Matchers::WithinRel;

namespace {

const CertifiedProblem& certified(const std::string& name) {
  for (const CertifiedProblem& problem : certified_problems()) {
    if (problem.name == name) return problem;
  }
  FAIL("no problem " << name);
  throw 0;
}

}  // namespace

TEST_CASE("NIST: derivatives of every curve agree with differences") {
  for (const CertifiedProblem& problem : certified_problems()) {
    const std::vector<double>& b = problem.estimates;
    std::vector<double> slopes(b.size()), unused(b.size());
    for (const double x : {problem.x.front(), problem.x[problem.x.size() / 2], problem.x.back()}) {
      problem.curve(x, b, slopes);
      for (std::size_t j = 0; j < b.size(); ++j) {
        CAPTURE(problem.name, x, j);
        std::vector<double> up = b, down = b;
        const double step = 1e-6 * std::abs(b[j]);
        up[j] += step;
        down[j] -= step;
        const double found =
            (problem.curve(x, up, unused) - problem.curve(x, down, unused)) / (2.0 * step);
        CHECK(std::abs(found - slopes[j]) <= 1e-5 * (std::abs(slopes[j]) + 1e-9));
      }
    }
  }
}

TEST_CASE("NIST: random starts find the certified answer where published starts are not given") {
  for (const char* name : {"Misra1a", "BoxBOD"}) {
    const CertifiedProblem& problem = certified(name);
    // A box that spans both published starts by a factor of 20 on each side.
    std::vector<FitParameter> parameters = certified_parameters(problem.starts[0]);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      parameters[i].scale = Scale::log;
      parameters[i].lower = std::min(problem.starts[0][i], problem.starts[1][i]) / 20.0;
      parameters[i].upper = std::max(problem.starts[0][i], problem.starts[1][i]) * 20.0;
      parameters[i].start = parameters[i].lower;
    }
    for (const std::uint64_t seed : {0U, 1U, 2U}) {
      const FitResult fit = fit_residuals(CertifiedResiduals(problem), parameters,
                                          latin_hypercube_starts(parameters, 20, seed),
                                          certified_threshold(problem), false);
      CHECK_THAT(fit.best.deviance, WithinRel(problem.sum_of_squares, 1e-7));
      for (std::size_t i = 0; i < problem.estimates.size(); ++i) {
        CAPTURE(name, seed, i);
        CHECK_THAT(fit.best.natural[i], WithinRel(problem.estimates[i], 1e-7));
        REQUIRE(fit.parameters[i].standard_error.has_value());
        CHECK_THAT(*fit.parameters[i].standard_error,
                   WithinRel(problem.standard_deviations[i], 1e-7));
      }
    }
  }
}

TEST_CASE("NIST: profile intervals of Misra1a agree with certified standard deviations") {
  // The problem is nearly linear, so the F interval is close to +- t(0.975, 12) sd = 2.1788 sd.
  const CertifiedProblem& problem = certified("Misra1a");
  const FitResult fit = fit_certified(problem, problem.starts[1], 0.0, true);
  for (std::size_t i = 0; i < 2; ++i) {
    const ParameterResult& p = fit.parameters[i];
    REQUIRE(p.verdict == Verdict::identified);
    const double half = 2.1788128 * problem.standard_deviations[i];
    CHECK_THAT(*p.upper - *p.lower, WithinRel(2.0 * half, 0.01));
  }
}
