#include <boost/math/distributions/binomial.hpp>
#include <catch2/catch.hpp>

#include "sensitivity_problems.hpp"

namespace tpm::base {
namespace {

constexpr std::uint64_t kRepetitions = 1000;

/// Exact two-sided p-value of `covered` of kRepetitions if each is covered with 95 %: twice the
/// smaller tail (Clopper and Pearson).
double p_value(std::uint64_t covered) {
  const boost::math::binomial all(static_cast<double>(kRepetitions), 0.95);
  const auto count = static_cast<double>(covered);
  const double below = cdf(all, count);
  const double above = covered == 0 ? 1.0 : cdf(complement(all, count - 1.0));
  return std::min(1.0, 2.0 * std::min(below, above));
}

TEST_CASE("Intervals of Sobol indices hold the true value in 95 of 100 studies") {
  for (const SensitivityProblem& problem : {ishigami(), g_function()}) {
    const auto inputs = static_cast<std::size_t>(problem.inputs);
    std::vector<std::uint64_t> first(inputs, 0), total(inputs, 0);
    for (std::uint64_t seed = 0; seed < kRepetitions; ++seed) {
      const SensitivityDesign design{problem.inputs, 64, 32, seed};
      const SensitivityResult found = sobol_indices(design, outputs_of(problem, design));
      for (std::size_t i = 0; i < inputs; ++i) {
        const auto holds = [](const IndexEstimate& e, double true_value) {
          return e.low <= true_value && true_value <= e.high;
        };
        first[i] += holds(found.inputs[i].first_order, problem.first_order[i]) ? 1 : 0;
        total[i] += holds(found.inputs[i].total, problem.total[i]) ? 1 : 0;
      }
    }
    for (std::size_t i = 0; i < inputs; ++i) {
      INFO(problem.name << ", input " << i + 1 << ": first order " << first[i] << ", total "
                        << total[i] << " of " << kRepetitions);
      // 14 tests of one level: 0.05 / 14 (Bonferroni).
      CHECK(p_value(first[i]) > 0.0035);
      CHECK(p_value(total[i]) > 0.0035);
    }
  }
}

}  // namespace
}  // namespace tpm::base
