#include "tpm/contact/zone_claim.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::contact {
namespace {

constexpr std::size_t kClaimIntervals = 24;

}  // namespace

ZoneClaim::ZoneClaim(double deepest_m)
    : stride_m_(deepest_m / static_cast<double>(kClaimIntervals)) {
  bound_N_per_m_.fill(std::vector<double>(kClaimIntervals + 1, 0.0));
}

void ZoneClaim::set_weights(const ServoWeights& weights) {
  branches_.clear();
  const auto add = [&](float share, float keep, float of_start, float of_end) {
    branches_.push_back({static_cast<double>(share), static_cast<double>(keep),
                         static_cast<double>(of_start), static_cast<double>(of_end)});
  };
  for (const ServoBranch& b : weights.branches) add(b.share, b.keep, b.of_start, b.of_end);
  if (branches_.empty()) add(1.0F, weights.keep, weights.of_start, weights.of_end);
  reset();
}

void ZoneClaim::reset() noexcept {
  for (Branch& branch : branches_) branch.viscous_m = 0.0;
  depth_m_ = 0.0;
  place_ = {};
}

void ZoneClaim::advance(double depth_m) noexcept {
  double viscous_m = 0.0;
  for (Branch& branch : branches_) {
    branch.viscous_m =
        branch.keep * branch.viscous_m + branch.of_start * depth_m_ + branch.of_end * depth_m;
    viscous_m += branch.share * branch.viscous_m;
  }
  depth_m_ = depth_m;
  place_.reach_m = std::max(std::abs(depth_m), std::abs(viscous_m));
  place_.back = std::abs(viscous_m) > std::abs(depth_m);
}

double ZoneClaim::at(const ZonePlace& place, double aside_m) const noexcept {
  const std::vector<double>& bound = bound_N_per_m_[place.back ? 1 : 0];
  const auto last = static_cast<double>(bound.size() - 1);
  const double at = std::clamp(place.reach_m / stride_m_, 0.0, last);
  const std::size_t low = std::min(static_cast<std::size_t>(at), bound.size() - 2);
  const double share = at - static_cast<double>(low);
  return place.reach_m * ((1.0 - share) * bound[low] + share * bound[low + 1]) +
         aside_m * aside_N_per_m_;
}

void ZoneClaim::require(const ZonePlace& place, double error_N) {
  if (!(place.reach_m > 0.0)) return;
  std::vector<double>& bound = bound_N_per_m_[place.back ? 1 : 0];
  const auto last = static_cast<double>(bound.size() - 1);
  const double at = std::clamp(place.reach_m / stride_m_, 0.0, last);
  for (const double node : {std::floor(at), std::ceil(at)}) {
    double& there = bound[static_cast<std::size_t>(node)];
    there = std::max(there, error_N / place.reach_m);
  }
}

void ZoneClaim::require_aside(const ZonePlace& place, double aside_m, double error_N) {
  aside_N_per_m_ = std::max(aside_N_per_m_, (error_N - at(place, 0.0)) / aside_m);
}

}  // namespace tpm::contact
