#pragma once
// Random laws in a loop, moved at random, one put in the place of the other.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/contact/law_handover.hpp"

namespace tpm::test {
using namespace contact;

inline LawFile random_law(Random& random) {
  static const std::vector<std::string> names{
      "linear",  "linear-1", "linear-2",         "linear-3", "power-1",
      "power-2", "hertz-1",  "linear-1-elastic", "power",    "linear-2-relaxing"};
  LawFile law;
  law.spec = parse_law_name(names[random.below(names.size())], "random");
  law.spec.reference = 1e-3 * std::exp(1.5 * random.uniform());
  for (const LawParameter& p : law_parameters(law.spec)) {
    const double wide = std::pow(10.0, 2.0 * random.uniform() - 1.0);
    law.values.push_back(p.name == "exponent"             ? 1.0 + 2.0 * random.uniform()
                         : p.name == "tension_share"      ? random.uniform()
                         : p.name == "spacing"            ? 5e-3 + 3e-2 * random.uniform()
                         : p.dimension == Dimension::time ? 0.3 * wide
                         : p.nuisance                     ? 0.0
                                                          : 80.0 * wide);
  }
  law.provenance = Provenance::assumed;
  return law;
}

struct HandOverOutcome {
  HandOver decision;
  double force_jump_N = 0.0;     ///< of the force that the new law answers with
  double energy_risen_J = 0.0;   ///< stored by the new law less by the old one
  double largest_force_N = 0.0;  ///< of the motion, for the scale
  double largest_energy_J = 0.0;
};

/// Moves a random law at random through 0.2 to 2 s at 1 kHz and considers another law then.
inline HandOverOutcome random_hand_over(Random& random) {
  const LawContactSettings settings{
      .period_s = 1e-3, .longest_s = 10.0, .deepest_m = 8e-3, .deepest_valid_m = 1e-2};
  LawInLoop from(random_law(random), settings);
  LawInLoop to(random_law(random), settings);
  const double mean = 5e-3 * random.uniform(), slow = 3.0 * random.uniform();
  const double swing = mean * random.uniform(), phase = 6.28 * random.uniform();
  const double fast = std::pow(10.0, 2.0 * random.uniform());
  const int periods = 200 + static_cast<int>(random.below(1800));
  HandOverOutcome outcome;
  for (int i = 0; i <= periods; ++i) {
    const double t = 1e-3 * i, rise = std::min(1.0, 5.0 * t);
    double depth =
        rise * (mean * (1.0 + 0.5 * std::sin(slow * t)) + swing * std::sin(fast * t + phase));
    depth = std::max(depth, 0.0);
    (void)from.contact.step(Eigen::Vector3d(0.0, 0.0, depth));
    outcome.largest_force_N = std::max(outcome.largest_force_N, std::abs(from.force_N()));
    outcome.largest_energy_J = std::max(outcome.largest_energy_J, from.stored_J());
  }
  outcome.decision = consider_hand_over(from, to);
  if (!outcome.decision.possible) return outcome;
  hand_over(outcome.decision, to);
  outcome.force_jump_N = std::abs(to.force_N() - from.force_N());
  outcome.energy_risen_J = to.stored_J() - from.stored_J();
  return outcome;
}

}  // namespace tpm::test
