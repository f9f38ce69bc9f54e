// measure_placement onset|drift SIMULATIONS SEED: errors of the onset of contact, and how often the
// intervals of fits with a measured zero, contact and drift hold the true value
// (reports/fits).
#include <cstdio>
#include <string>

#include "placement_studies.hpp"
#include "program.hpp"

namespace {

using namespace tpm;
using test::PlacedTest;

void onset(int simulations, std::uint64_t seed) {
  fmt::print(
      "| law | tau | noise of the peak | mean error | scatter | stated | part of the ramp | "
      "3 sigma is late by |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  struct Row {
    const char* law;
    std::vector<double> material;
    double exponent;
  };
  const std::vector<Row> rows{{"linear-1", {60.0, 45.0, 2.0}, 1.0},
                              {"linear-1", {60.0, 90.0, 0.5}, 1.0},
                              {"hertz-1", {60.0, 45.0, 2.0}, 1.5},
                              {"hertz-1", {60.0, 90.0, 0.5}, 1.5},
                              {"power-1", {60.0, 45.0, 2.0, 2.0}, 2.0}};
  for (const Row& row : rows) {
    for (const double noise : {5e-4, 2e-3, 1e-2}) {
      PlacedTest made;
      made.law = row.law;
      made.material = row.material;
      made.step_s = 0.01;
      made.hold_s = 5.0;
      made.zero_N = 5e-3;
      made.start_m = -0.5e-3;
      const Recording clean = test::placed(made);
      made.noise_N = noise * *std::ranges::max_element(clean.response);
      const auto e = test::onset_errors(made, row.exponent, simulations, seed);
      fmt::print("| `{}` | {} s | {} % | {:.2f} % | {:.2f} % | {:.2f} % | {:.0f} % | {:.1f} % |\n",
                 row.law, row.material[2], 100.0 * noise, 100.0 * e.mean, 100.0 * e.scatter,
                 100.0 * e.stated, 100.0 * e.part, 100.0 * e.threshold);
      std::fflush(stdout);
    }
  }
}

void drift(int simulations, std::uint64_t seed) {
  fmt::print(
      "| rest | after withdrawal | phi | parameter | interval holds the true value | drift in the "
      "fit |\n| --- | --- | --- | --- | --- | --- |\n");
  struct Row {
    double rest_s, after_s, phi;
  };
  for (const Row& row : {Row{10.0, 0.0, 0.0}, Row{2.0, 10.0, 0.0}, Row{20.0, 0.0, 0.5}}) {
    PlacedTest made;
    made.rest_s = row.rest_s;
    made.after_s = row.after_s;
    made.phi = row.phi;
    made.noise_N = 1e-3;
    made.step_s = 0.1;
    const auto c = test::drift_coverage(made, 3e-4, simulations, seed);
    for (const test::Held& p : c.parameters) {
      fmt::print("| {} s | {} s | {} | {} | {:.1f} % of {} | {} |\n", row.rest_s, row.after_s,
                 row.phi, p.name, 100.0 * p.share(), p.trials, c.told);
    }
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return tpm::test::measured(argc, argv, 3, 3,
                             "usage: measure_placement onset|drift SIMULATIONS SEED",
                             [](const std::vector<std::string>& words) {
                               const int simulations = std::stoi(words[1]);
                               const auto seed = std::stoull(words[2]);
                               if (words[0] == "onset") {
                                 onset(simulations, seed);
                               } else {
                                 drift(simulations, seed);
                               }
                             });
}
