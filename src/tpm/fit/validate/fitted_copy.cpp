#include "tpm/fit/validate/fitted_copy.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {
namespace {

constexpr double kNear = 0.02;                  // of the scatter
constexpr double kSameTime = 0.05;              // of the sampling interval
constexpr double kSameDrive = 1e-5;             // of the largest
constexpr double kWhereNothingScatters = 1e-8;  // of the largest, where nothing scatters

double largest(const std::vector<double>& values) {
  double size = 0.0;
  for (const double v : values) size = std::max(size, std::abs(v));
  return size;
}

/// Compares readings at times that differ by one shift.
class Overlay {
 public:
  Overlay(const Recording& of, const Recording& in, double sigma)
      : of_(of),
        in_(in),
        time_(kSameTime * std::min(median_step(of.time_s), median_step(in.time_s))),
        drive_(kSameDrive * largest(of.drive)),
        response_(std::max(kNear * sigma, kWhereNothingScatters * largest(of.response))) {}

  /// From here on readings agree that differ by what these two do: the zero of depth and force is
  /// another one.
  void take_shift_at(std::size_t i, std::size_t in) {
    drive_shift_ = in_.drive[in] - of_.drive[i];
    response_shift_ = in_.response[in] - of_.response[i];
  }

  [[nodiscard]] bool same(std::size_t i, double later_s) const {
    const double t = of_.time_s[i] + later_s;
    auto next = static_cast<std::size_t>(
        std::lower_bound(in_.time_s.begin(), in_.time_s.end(), t - time_) - in_.time_s.begin());
    if (next == in_.time_s.size()) return false;
    if (in_.time_s[next] <= t + time_) return same(i, in_.drive[next], in_.response[next]);
    if (next == 0) return false;
    const double share = (t - in_.time_s[next - 1]) / (in_.time_s[next] - in_.time_s[next - 1]);
    return same(i, std::lerp(in_.drive[next - 1], in_.drive[next], share),
                std::lerp(in_.response[next - 1], in_.response[next], share));
  }
  /// Of about `most` samples over the whole recording.
  [[nodiscard]] double share(double later_s, std::size_t most) const {
    const std::size_t n = of_.time_s.size(), stride = std::max<std::size_t>(n / most, 1);
    std::size_t found = 0, asked = 0;
    for (std::size_t i = 0; i < n; i += stride, ++asked) found += same(i, later_s);
    return static_cast<double>(found) / static_cast<double>(asked);
  }

 private:
  [[nodiscard]] bool same(std::size_t i, double drive, double response) const {
    return std::abs(drive - of_.drive[i] - drive_shift_) <= drive_ &&
           std::abs(response - of_.response[i] - response_shift_) <= response_;
  }

  const Recording& of_;
  const Recording& in_;
  double time_, drive_, response_;
  double drive_shift_ = 0.0, response_shift_ = 0.0;
};

/// Of the readings of a copy whose zeros were moved. Held tissue differs by a constant from stiffer
/// tissue, too, and what is at rest from anything at rest: the ramp must agree as well.
double share_of_shifted(const Recording& of, const Recording& in, double sigma) {
  constexpr std::size_t kAnchors = 3, kFew = 8;
  constexpr double kNearlyAll = 0.9, kRampFrom = 0.1, kRampTo = 0.9;  // of the drive's range
  const std::size_t n = of.time_s.size();
  const auto [low, high] = std::ranges::minmax_element(of.drive);
  std::vector<std::size_t> ramp;
  for (std::size_t i = 0; i < n; ++i) {
    const double part = (of.drive[i] - *low) / (*high - *low);
    if (part > kRampFrom && part < kRampTo) ramp.push_back(i);
  }
  if (ramp.empty()) return 0.0;
  Overlay overlay(of, in, sigma);
  for (std::size_t k = 0; k < kAnchors; ++k) {
    const std::size_t anchor = (2 * k + 1) * n / (2 * kAnchors);
    for (std::size_t j = 0; j < in.time_s.size(); ++j) {
      const double later_s = in.time_s[j] - of.time_s[anchor];
      overlay.take_shift_at(anchor, j);
      if (overlay.share(later_s, kFew) < kNearlyAll) continue;
      const double share = overlay.share(later_s, n);
      const auto agree =
          std::ranges::count_if(ramp, [&](std::size_t i) { return overlay.same(i, later_s); });
      const double of_ramp = static_cast<double>(agree) / static_cast<double>(ramp.size());
      if (std::min(share, of_ramp) >= kNearlyAll) return share;
    }
  }
  return 0.0;
}

}  // namespace

double share_of_readings(const Recording& of, const Recording& in, double sigma) {
  const std::size_t n = of.time_s.size();
  const bool whole = of.drive.size() == n && of.response.size() == n &&
                     in.drive.size() == in.time_s.size() && in.response.size() == in.time_s.size();
  if (!whole || n < 3 || in.time_s.size() < 3) return 0.0;
  const Overlay overlay(of, in, sigma);
  // One reading of the recording stands somewhere in the other; which of them may have been cut off
  // or replaced, at equal intervals perhaps: they are looked for by the golden section.
  constexpr std::size_t kAnchors = 8, kFew = 40;
  constexpr double kGolden = 0.6180339887498949;
  constexpr double kWorthAll = 0.25;
  double most = 0.0;
  // Readings between those of the other one, at its clock or from its start on.
  for (const double later_s : {0.0, in.time_s.front() - of.time_s.front()}) {
    if (overlay.share(later_s, kFew) > kWorthAll) most = std::max(most, overlay.share(later_s, n));
  }
  if (most > kWorthAll) return most;
  for (std::size_t k = 0; k < kAnchors; ++k) {
    const double place = std::fmod((static_cast<double>(k) + 0.5) * kGolden, 1.0);
    const auto anchor = static_cast<std::size_t>(place * static_cast<double>(n));
    for (const double t : in.time_s) {
      const double later_s = t - of.time_s[anchor];
      if (!overlay.same(anchor, later_s) || overlay.share(later_s, kFew) < kWorthAll) continue;
      most = std::max(most, overlay.share(later_s, n));
    }
    if (most > kWorthAll) return most;
  }
  return std::max(most, share_of_shifted(of, in, sigma));
}

}  // namespace tpm::fit
