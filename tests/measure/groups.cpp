// measure_groups STUDIES SEED: how often two groups of specimens that do not differ are found to
// differ, and how often those that do are, over sizes, spreads and standard errors
// (reports/fits/report.md).
#include <cstdio>
#include <string>

#include "group_studies.hpp"
#include "program.hpp"

namespace {

using namespace tpm;

std::string share(int count, int trials) {
  const auto [lower, upper] = test::exact_interval(count, trials);
  return fmt::format("{:.2f} % ({:.2f} .. {:.2f})", 100.0 * count / trials, 100.0 * lower,
                     100.0 * upper);
}

void table(int studies, std::uint64_t seed) {
  constexpr double kRatio = 1.5;
  fmt::print(
      "| specimens | spread tau | standard error | found without a difference | interval holds the "
      "ratio "
      "| found at a ratio of {} |\n| --- | --- | --- | --- | --- | --- |\n",
      kRatio);
  for (const auto& [first, second] : {std::pair{3, 3}, {5, 5}, {8, 8}, {3, 6}, {5, 10}, {8, 16}}) {
    for (const double spread : {0.0, 0.05, 0.2}) {
      const double unit = spread > 0.0 ? spread : 0.05;
      for (const double error : {unit / 3.0, unit, 3.0 * unit}) {
        if (spread == 0.0 && error != unit)
          continue;  // without spread only the ratio of errors counts
        const test::GroupDesign design{first, second, spread, error, 3.0, 0.0};
        test::GroupDesign apart = design;
        apart.difference = std::log(kRatio);
        const test::GroupCounts none = test::group_counts(design, studies, seed);
        const test::GroupCounts some = test::group_counts(apart, studies, seed + 1);
        fmt::print("| {}, {} | {} % | {:.3g} % | {} | {} | {:.1f} % |\n", first, second,
                   100.0 * spread, 100.0 * error, share(none.found, studies),
                   share(none.held + some.held, 2 * studies), 100.0 * some.found / studies);
        std::fflush(stdout);
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  return tpm::test::measured(argc, argv, 2, 2, "usage: measure_groups STUDIES SEED",
                             [](const std::vector<std::string>& words) {
                               table(std::stoi(words[0]), std::stoull(words[1]));
                             });
}
