// What the choice of a law for a creep compliance costs: J(t) of a Kelvin chain of two units with 1
// % noise, 60, 600 and 25,000 readings, from after the step and from the step itself. Prints the
// processor time of select_law with all laws of the family, the law that is recommended, and the
// largest deviation of its parameters from the chain's in standard errors.
//   measure_compliances [MOST_READINGS]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <utility>

#include "tpm/base/random.hpp"
#include "tpm/fit/select/material_function.hpp"
#include "tpmkit/law.hpp"

using namespace tpm;
using namespace tpm::fit;

namespace {

const KelvinChain kChain{1000.0, {500.0, 1000.0}, {1.0, 50.0}, 0.0};

MaterialFunction measured_compliance(int readings, bool from_step) {
  base::Random random(7);
  Recording recording;
  recording.drive_quantity = Quantity::stress;
  recording.response_quantity = Quantity::creep_compliance;
  for (int i = 0; i < readings; ++i) {
    const double share = i / (readings - 1.0);
    const double time = from_step ? 1000.0 * share : 0.01 * std::pow(1e5, share);
    double compliance = 1.0 / kChain.k0;
    for (std::size_t j = 0; j < kChain.k.size(); ++j) {
      compliance -= std::expm1(-time / kChain.T_s[j]) / kChain.k[j];
    }
    recording.time_s.push_back(time);
    recording.response.push_back(compliance * (1.0 + 0.01 * random.normal()));
  }
  return {"made", std::move(recording), {}, {}};
}

double largest_deviation(const FitResult& fit) {
  const Prony truth = to_parallel(kChain);
  std::vector<double> expected{truth.k_inf};
  expected.insert(expected.end(), truth.k.begin(), truth.k.end());
  expected.insert(expected.end(), truth.tau_s.begin(), truth.tau_s.end());
  double largest = 0.0;
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const ParameterResult& p = fit.parameters[i];
    if (fit.parameters.size() != expected.size() || !p.standard_error) return std::nan("");
    largest = std::max(largest, std::abs(p.estimate - expected[i]) / *p.standard_error);
  }
  return largest;
}

}  // namespace

int main(int count, char** words) {
  const int most = count > 1 ? std::atoi(words[1]) : 25'000;
  fmt::print("readings, from, processor time s, law, largest deviation in standard errors\n");
  for (const int readings : {60, 600, 25'000}) {
    for (const bool from_step : {false, true}) {
      if (readings > most) continue;
      SelectionOptions options;
      options.setup.starts = 40;
      const MaterialFunction function = measured_compliance(readings, from_step);
      const std::clock_t start = std::clock();
      const Selection s = select_law(function, options);
      const double taken_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      const Candidate& chosen = s.candidates[s.recommended];
      // Another law has other parameters: 60 even readings do not see the faster unit.
      fmt::print("{}, {}, {:.2f}, {}, {:.2f}\n", readings, from_step ? "0 s" : "0.01 s", taken_s,
                 law_name(chosen.law), largest_deviation(chosen.fit));
    }
  }
  return 0;
}
