// measure_specimens TRIALS SEED: how far the coefficients of ten recordings of one material spread
// that were pushed to unequal depths, from unequal preloads, with unequal zeros, and how far their
// pooled mean is from the true value (reports/fits/report.md).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "placed_specimens.hpp"
#include "program.hpp"
#include "tpm/base/median.hpp"

namespace {

using namespace tpm;

/// One coefficient over the trials of a row.
struct Tally {
  std::string name;
  int trials = 0, identified = 0, held = 0, pooled_identified = 0;
  std::vector<double> of_fitted, of_identified;  ///< largest over smallest, of each trial
  std::vector<double> distances;                 ///< without their signs

  void add(const test::CoefficientSpread& spread) {
    name = spread.name;
    ++trials;
    identified += spread.identified.count;
    held += spread.held ? 1 : 0;
    pooled_identified += spread.pooled_identified ? 1 : 0;
    if (const auto ratio = spread.fitted.ratio()) of_fitted.push_back(*ratio);
    if (const auto ratio = spread.identified.ratio()) of_identified.push_back(*ratio);
    if (spread.distance) distances.push_back(std::abs(*spread.distance));
  }
  [[nodiscard]] double percent(int count) const { return 100.0 * count / trials; }
};

/// "1.02 (1.10)", or "-" of nothing.
std::string with_worst(double typical, const std::vector<double>& values, int digits) {
  if (values.empty()) return "-";
  return fmt::format("{:.{}f} ({:.{}f})", typical, digits, *std::ranges::max_element(values),
                     digits);
}

std::string median_and_worst(const std::vector<double>& ratios) {
  return with_worst(ratios.empty() ? 0.0 : base::median(ratios), ratios, 3);
}

std::string rms_and_worst(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double each : values) squares += each * each;
  return with_worst(std::sqrt(squares / static_cast<double>(values.size())), values, 1);
}

void table(int trials, std::uint64_t seed) {
  fmt::print(
      "| law | noise, % | no rest, % | | all ten | identified | the identified | pooled as "
      "identified, % | mean off | interval holds it, % |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  int not_fitted = 0;
  for (const char* law : {"linear-1", "hertz-1"}) {
    for (const double noise : {5e-4, 2e-3, 1e-2}) {
      for (const int without_rest : {0, 3, 6}) {
        test::PlacedSpecimens study;
        study.law = law;
        study.noise = noise;
        study.without_rest = without_rest;
        base::Random random(seed);
        std::vector<Tally> tallies(2);
        for (int i = 0; i < trials; ++i) {
          const auto spreads = test::coefficient_spreads(study, random);
          for (std::size_t k = 0; k < spreads.size(); ++k) tallies[k].add(spreads[k]);
          not_fitted += study.recordings - spreads.front().fitted.count;
        }
        for (const Tally& t : tallies) {
          fmt::print("| `{}` | {} | {} | {} | {} | {:.1f} | {} | {:.0f} | {} | {:.0f} |\n", law,
                     100.0 * noise, 100 * without_rest / study.recordings, t.name,
                     median_and_worst(t.of_fitted), static_cast<double>(t.identified) / t.trials,
                     median_and_worst(t.of_identified), t.percent(t.pooled_identified),
                     rms_and_worst(t.distances), t.percent(t.held));
        }
        std::fflush(stdout);
      }
    }
  }
  fmt::print("\n{} recordings could not be fitted\n", not_fitted);
}

}  // namespace

int main(int argc, char** argv) {
  return tpm::test::measured(argc, argv, 2, 2, "usage: measure_specimens TRIALS SEED",
                             [](const std::vector<std::string>& words) {
                               table(std::stoi(words[0]), std::stoull(words[1]));
                             });
}
