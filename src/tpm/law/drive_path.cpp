#include "tpm/law/drive_path.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::law {

std::optional<DrivePath> drive_path(const Protocol& protocol, std::span<const double> times_s) {
  const auto knots = protocol.knots();
  DrivePath path;
  path.start = knots.front().value;
  path.relaxed = protocol.equilibrium_at_start();
  path.time_scale = std::max(std::abs(knots.front().time_s), std::abs(knots.back().time_s));
  path.steps.reserve(knots.size() + times_s.size());
  path.steps_before.reserve(times_s.size());
  if (!std::is_sorted(times_s.begin(), times_s.end())) return std::nullopt;
  if (times_s.empty() || std::isinf(times_s.back())) return std::nullopt;
  Knot at = knots.front();
  const auto go_to = [&](double time_s, double value) {
    if (time_s > at.time_s) path.steps.push_back({at.value, value, time_s - at.time_s});
    at = {time_s, value};
  };
  std::size_t next = 1;
  for (const double time : times_s) {
    for (; next < knots.size() && knots[next].time_s <= time; ++next) {
      if (knots[next].time_s == knots[next - 1].time_s) return std::nullopt;
      go_to(knots[next].time_s, knots[next].value);
    }
    if (next == knots.size()) {
      go_to(time, at.value);
    } else if (time > at.time_s) {
      const Knot& from = knots[next - 1];
      const double share = (time - from.time_s) / (knots[next].time_s - from.time_s);
      go_to(time, from.value + (knots[next].value - from.value) * share);
    }
    path.steps_before.push_back(path.steps.size());
  }
  return path;
}

}  // namespace tpm::law
