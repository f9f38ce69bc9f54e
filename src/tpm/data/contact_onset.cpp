#include "tpm/data/contact_onset.hpp"

#include <algorithm>

#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::data {
namespace {

constexpr double kNoise = 5.0;   // standard deviations of the noise that a floor stays within
constexpr double kPart = 0.005;  // the same as a part of the peak, for recordings without noise

double median_of(const std::vector<double>& values, std::size_t first, std::size_t last) {
  const auto begin = values.begin();
  return median(
      {begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(last) + 1});
}

std::optional<std::size_t> first_rise(const std::vector<DrivePiece>& pieces) {
  for (const DrivePiece& piece : pieces) {
    if (piece.motion == Motion::rising) return piece.first;
  }
  return std::nullopt;
}

std::size_t peak_index(const std::vector<double>& values) {
  return static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
}

/// The level of the response while the drive rests, or the lowest of the first samples if it never
/// does: the others may be in contact already.
double floor_before(const std::vector<double>& response, std::size_t motion_start) {
  constexpr std::size_t kFew = 3;
  if (motion_start + 1 >= kFew) return median_of(response, 0, motion_start);
  const std::size_t few = std::min(kFew, response.size());
  return *std::min_element(response.begin(), response.begin() + static_cast<std::ptrdiff_t>(few));
}

/// Least squares of y = b + k max(u - u_j, 0) over samples 0 to `last`: the corner j, not before
/// `first`, that explains most. One pass with sums from the end.
std::size_t corner_of_rise(const std::vector<double>& u, const std::vector<double>& y,
                           std::size_t first, std::size_t last) {
  const auto n = static_cast<double>(last + 1);
  double mean = 0.0;
  for (std::size_t i = 0; i <= last; ++i) mean += y[i] / n;
  double count = 0.0, sum_u = 0.0, sum_uu = 0.0, sum_y = 0.0, sum_uy = 0.0;
  std::size_t best = first;
  double most = 0.0;
  for (std::size_t j = last; j-- > first;) {
    const double x = u[j + 1] - u[0];
    count += 1.0;
    sum_u += x;
    sum_uu += x * x;
    sum_y += y[j + 1] - mean;
    sum_uy += x * (y[j + 1] - mean);
    const double corner = u[j] - u[0];
    const double rise = sum_u - count * corner;
    const double spread = sum_uu - 2.0 * corner * sum_u + count * corner * corner - rise * rise / n;
    const double covariance = sum_uy - corner * sum_y;
    if (spread <= 0.0 || covariance <= 0.0) continue;
    const double explained = covariance * covariance / spread;
    if (explained < most) continue;
    most = explained;
    best = j;
  }
  return best;
}

}  // namespace

std::optional<std::size_t> first_reaching(const std::vector<double>& values, std::size_t first,
                                          std::size_t last, double level, std::size_t count) {
  std::size_t run = 0;
  for (std::size_t i = first; i <= last; ++i) {
    run = values[i] >= level ? run + 1 : 0;
    if (run == count) return i + 1 - count;
  }
  return std::nullopt;
}

double touch_margin(const TouchSearch& search) {
  const auto [low, high] = std::minmax_element(search.response.begin(), search.response.end());
  return std::max(kNoise * search.noise_sd, kPart * (*high - *low));
}

Touch find_touch(const TouchSearch& search, std::optional<double> level) {
  constexpr double kWindow =
      3.0;  // margins above the floor: near contact the rise is nearly straight
  constexpr double kNoTravel = 0.02;  // of the drive's range
  const auto& [drive, response, pieces, noise, sustained] = search;
  const auto start = first_rise(pieces);
  Touch touch;
  touch.motion_start = start.value_or(0);
  touch.floor = floor_before(response, touch.motion_start);
  const double margin = touch_margin(search);
  if (!start || margin <= 0.0) return touch;
  const std::size_t end = response.size() - 1;
  const auto above = first_reaching(response, 0, end, touch.floor + margin, sustained);
  if (level) {
    touch.index = first_reaching(response, 0, end, *level, sustained);
  } else if (above && *above <= touch.motion_start) {
    touch.index = touch.motion_start;
  } else if (above) {
    const std::size_t peak = std::max(peak_index(response), *above);
    const auto far = first_reaching(response, *above, peak, touch.floor + kWindow * margin, 1);
    const std::size_t last = std::min(std::max(far.value_or(peak), *above + sustained), end);
    touch.index = corner_of_rise(drive, response, touch.motion_start, last);
  }
  if (touch.index) {
    const auto [low, high] = std::minmax_element(drive.begin(), drive.end());
    touch.instantaneous =
        drive[*touch.index] - drive[touch.motion_start] < kNoTravel * (*high - *low);
  }
  return touch;
}

std::optional<Release> find_release(const TouchSearch& search, const DrivePiece& falling,
                                    double contact_floor) {
  const auto& [drive, response, pieces, noise, sustained] = search;
  const std::size_t least = std::max<std::size_t>(sustained, 3);
  if (falling.last - falling.first + 1 < least + 1) return std::nullopt;
  const double margin = touch_margin(search);
  double lowest = response[falling.first];
  for (std::size_t i = falling.first + 1; i < falling.last; ++i) {
    lowest = std::min(lowest, median({response[i - 1], response[i], response[i + 1]}));
  }
  if (lowest > contact_floor + margin) return std::nullopt;
  std::vector<double> bottom;
  for (std::size_t i = falling.first; i <= falling.last; ++i) {
    if (response[i] <= lowest + 0.5 * margin) bottom.push_back(response[i]);
  }
  const double floor = median(bottom);
  // Half of all samples at the floor lie above it: within one standard deviation will do.
  const double reached = floor + margin / kNoise;
  std::size_t run = 0;
  for (std::size_t i = falling.first; i <= falling.last; ++i) {
    run = response[i] <= reached ? run + 1 : 0;
    if (run < least) continue;
    const std::size_t index = i + 1 - least;
    return Release{index, floor};
  }
  return std::nullopt;
}

}  // namespace tpm::data
