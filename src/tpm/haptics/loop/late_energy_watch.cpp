#include "tpm/haptics/loop/late_energy_watch.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::haptics {
namespace {

std::size_t whole_periods(double time_s, double period_s) {
  return static_cast<std::size_t>(std::max(1.0, std::round(time_s / period_s)));
}

}  // namespace

LateEnergyWatch::LateEnergyWatch(const LateEnergyWatchSettings& settings)
    : settings_(settings),
      sent_N_(whole_periods(kDelays_s.back(), settings.period_s) + 1, Eigen::Vector3d::Zero()),
      block_periods_(whole_periods(settings.window_s / double{kBlocks}, settings.period_s)),
      friction_N_per_m_(settings.friction_N_s_per_m / settings.period_s) {
  for (std::size_t i = 0; i < kDelays_s.size(); ++i) {
    supposed_[i].periods = whole_periods(kDelays_s[i], settings.period_s);
    supposed_[i].counts = kDelays_s[i] > settings.told_s + 0.5 * settings.period_s;
  }
}

void LateEnergyWatch::observe(const Eigen::Vector3d& sent_N, const Eigen::Vector3d& moved_m,
                              double tissue_work_J, int periods) noexcept {
  for (int i = 0; i < periods; ++i) {  // a command stays until the next one
    if (++newest_ == sent_N_.size()) newest_ = 0;
    sent_N_[newest_] = sent_N;
  }
  in_block_ += static_cast<std::uint64_t>(periods);
  const bool next = in_block_ >= block_periods_;
  if (next) {
    in_block_ = 0;
    if (++block_ == kBlocks) block_ = 0;
  }
  double same_J = tissue_work_J;
  if (friction_N_per_m_ > 0.0) {
    same_J -= friction_N_per_m_ * moved_m.squaredNorm() / static_cast<double>(periods);
  }
  delivered_J_ = 0.0;
  for (Supposed& s : supposed_) {
    if (!s.counts) continue;
    const std::size_t then =
        newest_ >= s.periods ? newest_ - s.periods : newest_ + sent_N_.size() - s.periods;
    s.energy_J += sent_N_[then].dot(moved_m) + same_J;
    if (next) {
      s.lowest_in_J[block_] = s.energy_J;
      s.lowest_J = *std::min_element(s.lowest_in_J.begin(), s.lowest_in_J.end());
    } else {
      s.lowest_in_J[block_] = std::min(s.lowest_in_J[block_], s.energy_J);
      s.lowest_J = std::min(s.lowest_J, s.energy_J);
    }
    delivered_J_ = std::max(delivered_J_, s.energy_J - s.lowest_J);
  }
}

}  // namespace tpm::haptics
