#include "tpm/haptics/loop/energy_watch.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::haptics {

EnergyWatch::EnergyWatch(const EnergyWatchSettings& settings)
    : settings_(settings),
      pending_N_(static_cast<std::size_t>(std::max(settings.delay_periods, 0)) + 1,
                 Eigen::Vector3d::Zero()),
      block_periods_(static_cast<std::uint64_t>(
          std::max(1.0, std::round(settings.window_s / (settings.period_s * double{kBlocks}))))),
      friction_N_per_m_(settings.friction_N_s_per_m / settings.period_s) {}

void EnergyWatch::observe(const Eigen::Vector3d& sent_N, const Eigen::Vector3d& moved_m,
                          double tissue_work_J, int periods) noexcept {
  Eigen::Vector3d acted_N = sent_N;
  for (int i = 0; i < periods; ++i) {  // a command stays until the next one
    pending_N_[oldest_] = sent_N;
    if (++oldest_ == pending_N_.size()) oldest_ = 0;  // a division would take as long as the rest
    acted_N = pending_N_[oldest_];
  }
  double friction_J = friction_N_per_m_ * moved_m.squaredNorm();
  if (periods > 1) friction_J /= static_cast<double>(periods);
  q_J_ += -acted_N.dot(moved_m) - tissue_work_J + friction_J;
  tissue_J_ += tissue_work_J;
  in_block_ += static_cast<std::uint64_t>(periods);
  if (in_block_ >= block_periods_) {
    in_block_ = 0;
    block_ = (block_ + 1) % kBlocks;
    largest_J_[block_] = q_J_;
    largest_of_all_J_ = *std::max_element(largest_J_.begin(), largest_J_.end());
  }
  largest_J_[block_] = std::max(largest_J_[block_], q_J_);
  largest_of_all_J_ = std::max(largest_of_all_J_, q_J_);
  delivered_J_ = largest_of_all_J_ - q_J_;
  most_delivered_J_ = std::max(most_delivered_J_, delivered_J_);
}

}  // namespace tpm::haptics
