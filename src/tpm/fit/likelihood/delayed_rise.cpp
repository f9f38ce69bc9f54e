#include "tpm/fit/likelihood/delayed_rise.hpp"

#include <algorithm>
#include <vector>

namespace tpm::fit {

Protocol with_delays(const Protocol& history, std::span<const DelayedRise> rises) {
  if (rises.empty()) return history;
  constexpr double kWithin = 1.0 - 1e-9;  // so that knots keep their order
  std::vector<Knot> knots(history.knots().begin(), history.knots().end());
  for (const DelayedRise& rise : rises) {
    const auto begin = std::ranges::lower_bound(knots, rise.begin_s, {}, &Knot::time_s);
    if (rise.delay_s == 0.0 || begin == knots.end() || begin + 1 == knots.end()) continue;
    const Knot first = *begin, last = *(begin + 1);
    if (first.time_s != rise.begin_s || last.time_s != rise.end_s) continue;
    const double lasts_s = last.time_s - first.time_s;
    const double away_s = std::clamp(2.0 * rise.delay_s, -kWithin * lasts_s, kWithin * lasts_s);
    Knot corner = away_s > 0.0 ? first : last;
    corner.time_s += away_s;
    knots.insert(begin + 1, corner);
  }
  Protocol delayed(history.drive(), std::move(knots), history.name());
  delayed.set_equilibrium_at_start(history.equilibrium_at_start());
  return delayed;
}

}  // namespace tpm::fit
