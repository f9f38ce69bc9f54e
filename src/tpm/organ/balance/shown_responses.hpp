#pragma once
// Extremes of the responses between the times asked for.
#include <algorithm>
#include <cmath>
#include <vector>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {

/// The largest absolute response of each group among the states that an observer was shown. Finds
/// what is larger within a step, so that the largest does not depend on the times asked for.
class ShownResponses {
 public:
  void see(const QuasiStaticState& state) {
    largest_.resize(1 + state.beside.size(), 0.0);
    for (std::size_t g = 0; g < largest_.size(); ++g) {
      largest_[g] = std::max(largest_[g], response(state, g));
    }
  }

  /// True if a response is larger than in all states seen.
  [[nodiscard]] bool exceeded_by(const QuasiStaticState& state) const {
    for (std::size_t g = 0; g <= state.beside.size(); ++g) {
      if (exceeds(response(state, g), g)) return true;
    }
    return false;
  }

  /// Adds the fractions of a step, its end left out, at which a response is largest in the step and
  /// larger than in all states seen.
  /// @param fractions rising, and rising afterwards
  void add_extremes(const StepEnergy& step, std::size_t groups,
                    std::vector<double>& fractions) const {
    for (std::size_t g = 0; g < groups; ++g) {
      const StepEnergy::Extreme found = step.largest_response(g);
      if (!(found.fraction < 1.0) || !exceeds(found.size, g)) continue;
      const auto at = std::lower_bound(fractions.begin(), fractions.end(), found.fraction);
      if (at == fractions.end() || *at != found.fraction) fractions.insert(at, found.fraction);
    }
  }

 private:
  static constexpr double kNotable = 1e-7;  // in parts of the largest; below lies rounding

  [[nodiscard]] static double response(const QuasiStaticState& state, std::size_t group) {
    return std::abs(group == 0 ? state.response : state.beside[group - 1]);
  }
  [[nodiscard]] bool exceeds(double size, std::size_t group) const {
    return group >= largest_.size() || size > (1.0 + kNotable) * largest_[group];
  }

  std::vector<double> largest_;  ///< by group
};

}  // namespace tpm::organ
