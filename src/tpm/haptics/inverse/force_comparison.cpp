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
  totals_ = {};
  published_.write(totals_);
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

void ForceComparison::no_report() noexcept {
  ++totals_.unnamed;
  published_.write(totals_);
}

void ForceComparison::report(const Eigen::Vector3d& force_N, std::int64_t at_ns) noexcept {
  ++totals_.named;
  compare(force_N, at_ns);
  published_.write(totals_);
}

void ForceComparison::compare(const Eigen::Vector3d& force_N, std::int64_t at_ns) noexcept {
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
    totals_.unasked_N = std::max(totals_.unasked_N, force_N.norm());
    totals_.unasked_ns += lasted_ns;
    return;
  }
  totals_.apart_ns += lasted_ns;
  if (apart_N <= totals_.farthest_N) return;
  totals_.farthest_N = apart_N;
  totals_.commanded_N = last_N_.norm();
  totals_.reported_N = force_N.norm();
}

std::vector<DeviceFinding> ForceComparison::findings() const {
  const Totals totals = published_.read();
  if (totals.named == 0 && totals.unnamed > 0) {
    return {{"force_not_reported",
             "the service reported no force: whether it renders those commanded is not known"}};
  }
  const auto in_all = [](std::int64_t ns) {
    return fmt::format("for {:.3g} s in all", static_cast<double>(ns) * 1e-9);
  };
  std::vector<DeviceFinding> found;
  if (totals.unasked_ns > 0) {
    found.push_back(
        {"force_without_command",
         fmt::format("the service reported up to {:.3g} N where nothing was commanded, {}: another "
                     "client pushes (end it), or a tissue of the service",
                     totals.unasked_N, in_all(totals.unasked_ns))});
  }
  if (totals.apart_ns > 0) {
    found.push_back(
        {"force_differs",
         fmt::format("the service reported {:.3g} N where {:.3g} N was commanded, apart by up to "
                     "{:.3g} N, {}: another client may drive the device, or something may gate, "
                     "scale or add forces",
                     totals.reported_N, totals.commanded_N, totals.farthest_N,
                     in_all(totals.apart_ns))});
  }
  return found;
}

}  // namespace tpm::haptics
