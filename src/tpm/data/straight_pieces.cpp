#include "tpm/data/straight_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace tpm::data {
namespace {

/// The knots that the straight lines between them leave within a distance of all others.
std::vector<Knot> in_straight_pieces(std::span<const Knot> knots, double within) {
  std::vector<bool> kept(knots.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> pieces{{0, knots.size() - 1}};
  while (!pieces.empty()) {
    const auto [from, to] = pieces.back();
    pieces.pop_back();
    const Knot &begin = knots[from], &end = knots[to];
    double furthest = within;
    std::size_t corner = from;
    for (std::size_t i = from + 1; i < to; ++i) {
      const double share = (knots[i].time_s - begin.time_s) / (end.time_s - begin.time_s);
      const double off = std::abs(knots[i].value - begin.value - (end.value - begin.value) * share);
      if (off <= furthest) continue;
      furthest = off;
      corner = i;
    }
    if (corner == from) continue;
    kept[corner] = true;
    pieces.emplace_back(from, corner);
    pieces.emplace_back(corner, to);
  }
  std::vector<Knot> few;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (kept[i]) few.push_back(knots[i]);
  }
  return few;
}

}  // namespace

Protocol followed_by_organ(const Protocol& measured, double contact, double within) {
  double deepest = 0.0;
  for (const Knot& knot : measured.knots()) deepest = std::max(deepest, knot.value - contact);
  Protocol motion(measured.drive(), in_straight_pieces(measured.knots(), within * deepest),
                  measured.name());
  motion.set_equilibrium_at_start(measured.equilibrium_at_start());
  return motion;
}

}  // namespace tpm::data
