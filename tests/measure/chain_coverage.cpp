// measure_chain_coverage predict|contact|identify SIMULATIONS SEED: how often bands of predictions,
// intervals of fits whose contact is fixed or estimated, and intervals at the stopping time hold
// what they should (reports/chain).
#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "coverage_studies.hpp"

namespace {

using namespace tpm;
using namespace tpm::fit;

void predict(int simulations, std::uint64_t seed) {
  fmt::print(
      "| law | noise of the peak | phi | a held-out reading in its band | exact p of 95 % | "
      "all held-out readings | true value in the band of the mean | exact p | no covariance |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const SimulatedTest test = test::even_test(20.0, 0.05);
  for (const char* name : {"linear-1", "power-1", "linear-1-elastic"}) {
    for (const double phi : {0.0, 0.5}) {
      const auto c =
          test::held_out_coverage(parse_law_name(name, "law"), test, 0.01, phi, simulations, seed);
      fmt::print(
          "| `{}` | 1 % | {} | {:.1f} % of {} | {:.2g} | {:.2f} % | {:.1f} % | {:.2g} | {} |\n",
          name, phi, 100.0 * c.readings.share(), c.readings.trials,
          test::binomial_p(c.readings, 0.95), 100.0 * c.all_readings, 100.0 * c.means.share(),
          test::binomial_p(c.means, 0.95), c.failed);
      std::fflush(stdout);
    }
  }
}

void contact_coverage(int simulations, std::uint64_t seed) {
  fmt::print(
      "| contact | parameter | interval holds the true value | exact p of 95 % |\n"
      "| --- | --- | --- | --- |\n");
  for (const Nuisance nuisance : {Nuisance::offset, Nuisance::automatic}) {
    const auto c =
        test::fit_coverage(parse_law_name("linear-1", "law"), test::even_test(20.0, 0.02), 0.02,
                           0.0, nuisance, simulations, seed);
    for (std::size_t k = 0; k < c.names.size(); ++k) {
      fmt::print("| {} | {} | {:.1f} % of {} | {:.2g} |\n",
                 nuisance == Nuisance::offset ? "fixed where it was found" : "estimated",
                 c.names[k], 100.0 * c.parameters[k].share(), c.parameters[k].trials,
                 test::binomial_p(c.parameters[k], 0.95));
    }
  }
}

void identify(int simulations, std::uint64_t seed, double only) {
  fmt::print(
      "| law | phi | parameter | interval holds the true value | exact p of 95 % | stopped | "
      "mean stop | mean samples |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const double phi : {0.0, 0.9}) {
    if (only >= 0.0 && phi != only) continue;
    const SimulatedTest test = test::even_test(phi > 0.0 ? 30.0 : 20.0, 0.02);
    IdentifyOptions options;
    options.target = phi > 0.0 ? 0.15 : 0.05;
    const auto c = test::stopped_coverage(parse_law_name("linear-1", "law"), test, 0.02, phi,
                                          options, simulations, seed);
    for (std::size_t k = 0; k < c.names.size(); ++k) {
      fmt::print(
          "| `linear-1` | {} | {} | {:.1f} % of {} | {:.2g} | {} of {} | {:.2f} s | {:.0f} |\n",
          phi, c.names[k], 100.0 * c.parameters[k].share(), c.parameters[k].trials,
          test::binomial_p(c.parameters[k], 0.95), c.stopped, c.simulations, c.mean_stop_s,
          c.mean_samples);
    }
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr,
               "usage: measure_chain_coverage predict|contact|identify SIMULATIONS SEED "
               "[PHI]\n");
    return 2;
  }
  const int simulations = std::atoi(argv[2]);
  const auto seed = std::strtoull(argv[3], nullptr, 10);
  if (std::string(argv[1]) == "predict") {
    predict(simulations, seed);
  } else if (std::string(argv[1]) == "contact") {
    contact_coverage(simulations, seed);
  } else {
    identify(simulations, seed, argc > 4 ? std::atof(argv[4]) : -1.0);
  }
  return 0;
}
