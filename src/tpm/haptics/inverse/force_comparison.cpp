#include "tpm/haptics/inverse/force_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tpm::haptics {
namespace {

constexpr std::int64_t ns(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

}  // namespace

void ForceComparison::Commands::begin(const Eigen::Vector3d& force_N) noexcept {
  lowest_N = highest_N = force_N;
  largest_N = force_N.norm();
}

void ForceComparison::Commands::add(const Eigen::Vector3d& force_N) noexcept {
  lowest_N = lowest_N.cwiseMin(force_N);
  highest_N = highest_N.cwiseMax(force_N);
  largest_N = std::max(largest_N, force_N.norm());
}

void ForceComparison::begin(std::int64_t at_ns) noexcept {
  last_N_.setZero();
  now_.begin(last_N_);
  before_ = now_;
  since_ns_ = at_ns;
  apart_ = false;
  named_ = unnamed_ = 0;
  apart_ns_ = unasked_ns_ = 0;
  unasked_N_ = farthest_N_ = commanded_N_ = reported_N_ = 0.0;
}

void ForceComparison::command(const Eigen::Vector3d& force_N, std::int64_t at_ns) noexcept {
  if (at_ns - since_ns_ > ns(kLate_s)) {
    before_ = now_;
    now_.begin(last_N_);
    since_ns_ = at_ns;
  }
  now_.add(force_N);
  last_N_ = force_N;
}

void ForceComparison::report(const Eigen::Vector3d& force_N, std::int64_t at_ns) noexcept {
  ++named_;
  const Eigen::Vector3d lowest_N = now_.lowest_N.cwiseMin(before_.lowest_N),
                        highest_N = now_.highest_N.cwiseMax(before_.highest_N);
  const Eigen::Vector3d nearest_N = force_N.cwiseMax(lowest_N).cwiseMin(highest_N);
  const double apart_N = (force_N - nearest_N).cwiseAbs().maxCoeff();
  const double largest_N = std::max(now_.largest_N, before_.largest_N);
  if (apart_N <= kTolerance_N + kTolerance * largest_N) {
    apart_ = false;
    return;
  }
  if (!apart_) {
    apart_ = true;
    apart_since_ns_ = counted_until_ns_ = at_ns;
  }
  if (at_ns - apart_since_ns_ < ns(kLasts_s)) return;
  const std::int64_t lasted_ns = at_ns - counted_until_ns_;
  counted_until_ns_ = at_ns;
  if (largest_N == 0.0) {
    unasked_N_ = std::max(unasked_N_.load(), force_N.norm());
    unasked_ns_ += lasted_ns;
    return;
  }
  apart_ns_ += lasted_ns;
  if (apart_N <= farthest_N_) return;
  farthest_N_ = apart_N;
  commanded_N_ = last_N_.norm();
  reported_N_ = force_N.norm();
}

std::vector<std::string> ForceComparison::findings() const {
  if (named_ == 0 && unnamed_ > 0) {
    return {"the service reported no force: whether it renders those commanded is not known"};
  }
  const auto in_all = [](std::int64_t ns) {
    return fmt::format("for {:.3g} s in all", static_cast<double>(ns) * 1e-9);
  };
  std::vector<std::string> lines;
  if (unasked_ns_ > 0) {
    lines.push_back(fmt::format(
        "the service reported up to {:.3g} N where nothing was commanded, {}: another client "
        "pushes (end it), or a tissue of the service",
        unasked_N_.load(), in_all(unasked_ns_)));
  }
  if (apart_ns_ > 0) {
    lines.push_back(fmt::format(
        "the service reported {:.3g} N where {:.3g} N was commanded, apart by up to {:.3g} N, {}: "
        "another client may drive the device, or something may gate, scale or add forces",
        reported_N_.load(), commanded_N_.load(), farthest_N_.load(), in_all(apart_ns_)));
  }
  return lines;
}

}  // namespace tpm::haptics
