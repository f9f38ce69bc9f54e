#include "tpm/haptics/loop/start_gate.hpp"

#include <algorithm>
#include <cmath>

#include "tpmkit/servo_record.hpp"

namespace tpm::haptics {
namespace {

std::uint64_t gate_periods(double time_s, double period_s) noexcept {
  return static_cast<std::uint64_t>(std::llround(time_s / period_s));
}

}  // namespace

StartGate::StartGate(const StartGateSettings& settings, double period_s) noexcept
    : settings_(settings),
      needed_(gate_periods(settings.rest_time_s, period_s)),
      limit_(gate_periods(settings.limit_s, period_s)),
      most_unseen_(std::max<std::uint64_t>(1, gate_periods(kMostUnseen_s, period_s))) {}

std::uint32_t StartGate::see(std::uint64_t periods, const Eigen::Vector3d& position_m,
                             double depth_m, bool with_surface, bool pressed) noexcept {
  std::uint32_t missing = 0;
  // Written so that a position that is no number is never in place.
  if (!((position_m - settings_.centre_m).norm() <= settings_.reach_m)) missing |= kOutOfReach;
  if (with_surface && !(depth_m <= -settings_.clearance_m)) missing |= kInTissue;
  if (at_rest_ == 0 || !((position_m - anchor_m_).norm() <= settings_.rest_radius_m)) {
    anchor_m_ = position_m;
    at_rest_ = 1;
  } else {
    at_rest_ += std::min(periods, most_unseen_);
  }
  if (at_rest_ < needed_) missing |= kMoving;
  if (!settings_.confirm || missing != 0) return missing;
  const bool said = settings_.confirmed && settings_.confirmed->load(std::memory_order_acquire);
  return pressed || said ? 0 : static_cast<std::uint32_t>(kUnconfirmed);
}

}  // namespace tpm::haptics
