// Declared in tpm/accuracy/verify/verification.hpp.
// NIST's certified problems by the search that every fit uses (fit_residuals).
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tpm/accuracy/verify/certified_fit.hpp"
#include "tpm/accuracy/verify/verification.hpp"

namespace tpm::accuracy {
namespace {

using namespace fit;

/// The largest relative difference from the certified values: estimates, their standard deviations
/// and the sum of squares; of data without noise the estimates alone.
double off_certified(const CertifiedProblem& problem, const FitResult& fit) {
  double largest = 0.0;
  const auto compare = [&](double found, double certified) {
    const double off = std::abs(found / certified - 1.0);
    largest = std::isnan(off) ? off : std::max(largest, off);
  };
  for (std::size_t i = 0; i < problem.estimates.size(); ++i) {
    compare(fit.best.natural[i], problem.estimates[i]);
    if (problem.noise_free()) continue;
    const auto& deviation = fit.parameters[i].standard_error;
    compare(deviation.value_or(std::numeric_limits<double>::quiet_NaN()),
            problem.standard_deviations[i]);
  }
  if (!problem.noise_free()) compare(fit.best.deviance, problem.sum_of_squares);
  return largest;
}

}  // namespace

std::vector<VerificationCheck> regression_checks() {
  constexpr double kDigits = 5e-7;  // six of the eleven certified digits
  std::vector<VerificationCheck> checks;
  for (const CertifiedProblem& problem : certified_problems()) {
    for (std::size_t start = 0; start < problem.starts.size(); ++start) {
      checks.push_back(
          {fmt::format("{} ({} difficulty) from start {}", problem.name, problem.difficulty,
                       start + 1),
           problem.noise_free()
               ? "largest relative error of the estimates"
               : "largest relative error of estimates, standard deviations and sum of squares",
           fmt::format("NIST StRD, {}.dat, certified values", problem.name), 0.0, kDigits,
           [&problem, start](double flaw) {
             return off_certified(problem, fit_certified(problem, problem.starts[start], flaw));
           },
           problem.noise_free() ? "data without noise" : "data with noise"});
    }
  }
  return checks;
}

}  // namespace tpm::accuracy
