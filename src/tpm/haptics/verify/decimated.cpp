// Declared in tpm/haptics/verify/verify.hpp.
#include <algorithm>
#include <limits>

#include "tpm/haptics/verify/verify.hpp"

namespace tpm::haptics {
namespace {

/// The last sample to which a straight line from one passes all between within the tolerance: the
/// cone of its possible slopes narrows until it is empty (Sklansky and Gonzalez 1980).
std::size_t last_in_reach(const std::vector<double>& time, const std::vector<double>& value,
                          double tolerance, std::size_t from) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  double least = -kAny, most = kAny;
  std::size_t reached = from + 1;
  for (std::size_t i = from + 1; i < time.size() && least <= most; ++i) {
    const double away = time[i] - time[from];
    const double slope = (value[i] - value[from]) / away;
    if (slope >= least && slope <= most) reached = i;
    least = std::max(least, slope - tolerance / away);
    most = std::min(most, slope + tolerance / away);
  }
  return reached;
}

}  // namespace

std::vector<std::size_t> decimated(const std::vector<double>& time,
                                   const std::vector<double>& value, double tolerance) {
  std::vector<std::size_t> kept;
  if (time.empty()) return kept;
  kept.push_back(0);
  while (kept.back() + 1 < time.size()) {
    kept.push_back(last_in_reach(time, value, tolerance, kept.back()));
  }
  return kept;
}

}  // namespace tpm::haptics
