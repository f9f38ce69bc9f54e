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
      sent_N_(whole_periods(settings.lateness_s, settings.period_s) + 1, Eigen::Vector3d::Zero()),
      given_J_(whole_periods(settings.window_s, settings.period_s), 0.0),
      window_periods_(given_J_.size()),
      slowest_periods_(whole_periods(settings.slowest_s, settings.period_s)) {}

void LateEnergyWatch::observe(const Eigen::Vector3d& sent_N, double along_m,
                              const Eigen::Vector3d& moved_m, double tissue_work_J,
                              int periods) noexcept {
  Eigen::Vector3d acted_N = sent_N;
  for (int i = 0; i < periods; ++i) {  // a command stays until the next one
    sent_N_[newest_] = sent_N;
    if (++newest_ == sent_N_.size()) newest_ = 0;
    acted_N = sent_N_[newest_];
    energy_J_ -= given_J_[oldest_given_];
    given_J_[oldest_given_] = 0.0;
    if (i + 1 < periods && ++oldest_given_ == given_J_.size()) oldest_given_ = 0;
  }
  const double given_J = acted_N.dot(moved_m) + tissue_work_J;
  given_J_[oldest_given_] = given_J;
  energy_J_ += given_J;
  if (++oldest_given_ == given_J_.size()) oldest_given_ = 0;
  now_ += static_cast<std::uint64_t>(periods);
  turn(along_m);
  found_ = found_ || (energy_J_ > settings_.allowance_J && grows(along_m));
}

void LateEnergyWatch::turn(double along_m) noexcept {
  if (!begun_) {
    begun_ = true;
    extreme_m_ = turned_at_m_ = along_m;
    return;
  }
  if (into_ ? along_m > extreme_m_ : along_m < extreme_m_) {
    extreme_m_ = along_m;
    return;
  }
  if (std::abs(along_m - extreme_m_) <= settings_.least_m) return;
  strokes_[count_ % kStrokes] = {now_, std::abs(extreme_m_ - turned_at_m_)};
  ++count_;
  turned_at_m_ = extreme_m_;
  into_ = !into_;
  extreme_m_ = along_m;
}

bool LateEnergyWatch::grows(double along_m) const noexcept {
  if (count_ < kStrokes || now_ - back(kStrokes - 1).end >= window_periods_) return false;
  if (now_ - back(0).end >= slowest_periods_) return false;
  const double under_way_m = std::abs(along_m - turned_at_m_);
  const double latest_m = std::max(under_way_m, back(0).length_m);
  return latest_m >= settings_.growth * back(1).length_m &&
         back(0).length_m >= settings_.growth * back(2).length_m;
}

}  // namespace tpm::haptics
