// What the stand-ins have for a hand: at rest 2 mm above the surface for half a second, then down
// along -z at 4 mm/s to a depth of 2 mm.
#pragma once
#include <algorithm>

inline constexpr int kScriptedPeriods = 2000;

inline double scripted_height_m(int period) {
  const double time_s = 1e-3 * period;
  return std::max(-2e-3, 2e-3 - 4e-3 * std::max(0.0, time_s - 0.5));
}
