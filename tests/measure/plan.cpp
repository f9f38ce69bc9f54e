// Claimed against true errors of plans on random scenes: measure_plan SCENES SEED.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>

#include "../random_plan_scene.hpp"
#include "tpm/core/error.hpp"
#include "tpm/plan/plan.hpp"

namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct Tally {
  int count = 0, violated = 0;
  std::vector<double> ratio;
};

}  // namespace

int main(int argc, char** argv) {
  const int scenes = argc > 1 ? std::atoi(argv[1]) : 200;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoi(argv[2]) : 0);
  std::map<std::string, Tally> by_formulation;
  Tally picks, all;
  int none = 0, failed = 0, rejected = 0;
  for (int i = 0; i < scenes; ++i) {
    const tpm::test::RandomPlan random(seed, i);
    try {
      const tpm::Plan plan = tpm::make_plan(random.scene(), random.request());
      const auto add = [&](Tally& tally, const tpm::PlannedCandidate& c) {
        ++tally.count;
        if (*c.verified_error > *c.claimed_error + plan.reference.difference) ++tally.violated;
        tally.ratio.push_back(*c.claimed_error / std::max(*c.verified_error, 1e-12));
      };
      for (const tpm::PlannedCandidate& c : plan.candidates) {
        if (!c.claimed_error || !c.verified_error) continue;
        add(by_formulation[c.formulation], c);
        add(all, c);
        if (*c.verified_error > *c.claimed_error + plan.reference.difference) {
          fmt::print("violated in {}: {} claims {:.3g}, true {:.3g}\n", i, c.name, *c.claimed_error,
                     *c.verified_error);
        }
        if (c.reason.starts_with("verified:")) ++rejected;
      }
      if (plan.choice) {
        add(picks, plan.chosen());
        fmt::print("{} {}: {} claims {:.3g}, true {:.3g}, tolerance {:.3g}\n", i, random.words(),
                   plan.chosen().name, *plan.chosen().claimed_error, *plan.chosen().verified_error,
                   plan.request.tolerance);
      } else {
        ++none;
        fmt::print("{} {}: nothing meets tolerance and budget\n", i, random.words());
      }
    } catch (const tpm::Error& error) {
      ++failed;
      fmt::print("{} {}: {}\n", i, random.words(), error.what());
    }
  }
  fmt::print("\n{:<14} {:>6} {:>9} {:>16}\n", "", "count", "violated", "claimed/true");
  const auto row = [](const std::string& name, const Tally& t) {
    fmt::print("{:<14} {:>6} {:>9} {:>16.2f}\n", name, t.count, t.violated, median(t.ratio));
  };
  for (const auto& [name, tally] : by_formulation) row(name, tally);
  row("all", all);
  row("picks", picks);
  fmt::print("scenes {}, without a pick {}, failed {}, picks rejected by verification {}\n", scenes,
             none, failed, rejected);
  return 0;
}
