#include "tpm/protocol/straight_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace tpm {

Protocol in_straight_pieces(Drive drive, std::span<const double> time_s,
                            std::span<const double> value, double within) {
  const Protocol whole = measured_history(drive, time_s, value);  // refuses what is no history
  const std::size_t n = time_s.size();
  std::vector<bool> kept(n, false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> pieces{{0, n - 1}};
  while (!pieces.empty()) {
    const auto [from, to] = pieces.back();
    pieces.pop_back();
    double furthest = within;
    std::size_t corner = from;
    for (std::size_t i = from + 1; i < to; ++i) {
      const double share = (time_s[i] - time_s[from]) / (time_s[to] - time_s[from]);
      const double off = std::abs(value[i] - value[from] - (value[to] - value[from]) * share);
      if (off <= furthest) continue;
      furthest = off;
      corner = i;
    }
    if (corner == from) continue;
    kept[corner] = true;
    pieces.emplace_back(from, corner);
    pieces.emplace_back(corner, to);
  }
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < n; ++i) {
    if (kept[i]) knots.push_back({time_s[i], value[i]});
  }
  return {drive, std::move(knots), whole.name()};
}

Protocol followed_by_organ(const Protocol& measured) {
  std::vector<double> time_s, depth_m;
  for (const Knot& knot : measured.knots()) {
    time_s.push_back(knot.time_s);
    depth_m.push_back(knot.value);
  }
  const double deepest = std::max(*std::max_element(depth_m.begin(), depth_m.end()), 0.0);
  Protocol motion = in_straight_pieces(measured.drive(), time_s, depth_m, kMotionWithin * deepest);
  motion.set_relaxed_at_start(measured.relaxed_at_start());
  return motion;
}

}  // namespace tpm
