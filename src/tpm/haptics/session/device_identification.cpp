#include "tpm/haptics/session/device_identification.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"

namespace tpm::haptics {
namespace {

constexpr double kVelocityWindow_s = 0.064, kLongestDelay_s = 0.050;
constexpr double kEdge_N = 0.2, kCentring_N_per_m = 15.0;
constexpr double kShortestBit_s = 0.040, kLongestBit_s = 0.120;
constexpr int kUnknowns = 5;  // m, b, c, k, f
constexpr std::size_t kFewestWindows = 40;

/// (1 - s^2)^4 over -1 to 1 and its derivatives by s, smooth enough at the ends for sums over
/// samples to be integrals; its antiderivative from -1 on.
double bump(double s) {
  const double q = 1.0 - s * s;
  return q > 0.0 ? q * q * q * q : 0.0;
}
double bump_slope(double s) {
  const double q = 1.0 - s * s;
  return q > 0.0 ? -8.0 * s * q * q * q : 0.0;
}
double bump_curvature(double s) {
  const double q = 1.0 - s * s;
  return q > 0.0 ? -8.0 * q * q * q + 48.0 * s * s * q * q : 0.0;
}
double bump_area(double s) {
  const double x = std::clamp(s, -1.0, 1.0), y = x * x;
  return 128.0 / 315.0 +
         x * (1.0 + y * (-4.0 / 3.0 + y * (6.0 / 5.0 + y * (-4.0 / 7.0 + y / 9.0))));
}

struct Windows {
  std::vector<std::size_t> centre;  ///< samples
  Eigen::MatrixXd motion;           ///< a row each, kUnknowns columns
  double half_s = 0.0;
};

/// Motion in the middle of a window of 2 half + 1 samples, as m, b, c, k and f multiply it.
Eigen::RowVectorXd motion_around(const std::vector<IdentificationSample>& samples,
                                 std::size_t centre, std::size_t half, double period_s,
                                 double least_m) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(kUnknowns);
  const double half_s = static_cast<double>(half) * period_s;
  constexpr std::size_t kSlope = 8;
  for (std::size_t i = centre - half; i <= centre + half; ++i) {
    const double s =
        (static_cast<double>(i) - static_cast<double>(centre)) / static_cast<double>(half);
    const double x = samples[i].at_m;
    const double moved =
        samples[std::min(i + kSlope, samples.size() - 1)].at_m - samples[i - kSlope].at_m;
    const double sign = std::abs(moved) < least_m ? 0.0 : std::copysign(1.0, moved);
    const double w = bump(s) * period_s;
    row[0] += bump_curvature(s) / (half_s * half_s) * period_s * x;
    row[1] -= bump_slope(s) / half_s * period_s * x;
    row[2] += w * sign;
    row[3] += w * x;
    row[4] -= w;
  }
  return row;
}

/// The force over the window if it comes `delay_s` late; commands are held for a period.
double force_around(const std::vector<IdentificationSample>& samples, std::size_t centre,
                    std::size_t half, double period_s, double delay_s) {
  const double half_s = static_cast<double>(half) * period_s;
  const double middle_s = static_cast<double>(centre) * period_s;
  const double first = (middle_s - half_s - delay_s) / period_s - 1.0;
  const double last = (middle_s + half_s - delay_s) / period_s + 1.0;
  const auto from = static_cast<std::size_t>(std::max(0.0, std::floor(first)));
  const std::size_t to =
      std::min(samples.size() - 1, static_cast<std::size_t>(std::max(0.0, std::ceil(last))));
  double sum = 0.0;
  for (std::size_t i = from; i <= to; ++i) {
    const double begin = (static_cast<double>(i) * period_s + delay_s - middle_s) / half_s;
    sum += samples[i].force_N * (bump_area(begin + period_s / half_s) - bump_area(begin)) * half_s;
  }
  return sum;
}

bool is_covered(const std::vector<IdentificationSample>& samples, std::size_t from,
                std::size_t to) {
  return std::all_of(samples.begin() + static_cast<std::ptrdiff_t>(from),
                     samples.begin() + static_cast<std::ptrdiff_t>(to) + 1,
                     [](const IdentificationSample& s) { return s.missed == 0; });
}

/// The encoder's step: what nearly all changes of the position are whole multiples of.
std::optional<double> step_of(const std::vector<IdentificationSample>& samples) {
  constexpr double kLeast_m = 1e-9, kOff = 0.02, kNearlyAll = 0.99;
  double least = std::numeric_limits<double>::infinity();
  std::size_t changes = 0, fitting = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double change = std::abs(samples[i].at_m - samples[i - 1].at_m);
    if (change > kLeast_m) least = std::min(least, change);
  }
  if (!std::isfinite(least)) return std::nullopt;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double steps = std::abs(samples[i].at_m - samples[i - 1].at_m) / least;
    if (steps < 0.5) continue;
    ++changes;
    fitting += std::abs(steps - std::round(steps)) < kOff * std::max(1.0, steps) ? 1 : 0;
  }
  const bool one_step = static_cast<double>(fitting) >= kNearlyAll * static_cast<double>(changes);
  return one_step ? std::optional(least) : std::nullopt;
}

/// From third differences, in which a smooth motion is lost: the variance of noise is theirs / 20.
double noise_of(const std::vector<IdentificationSample>& samples) {
  double sum = 0.0;
  for (std::size_t i = 3; i < samples.size(); ++i) {
    const double d = samples[i].at_m - 3.0 * samples[i - 1].at_m + 3.0 * samples[i - 2].at_m -
                     samples[i - 3].at_m;
    sum += d * d;
  }
  return std::sqrt(sum / (20.0 * static_cast<double>(samples.size() - 3)));
}

struct Solution {
  Eigen::VectorXd value;
  Eigen::MatrixXd spread;  ///< covariance
  double rms = std::numeric_limits<double>::infinity();
};

Solution solve(const Windows& windows, const Eigen::VectorXd& force) {
  const Eigen::MatrixXd normal = windows.motion.transpose() * windows.motion;
  // Columns differ by orders of magnitude.
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> factors(
      scaled + 1e-12 * Eigen::MatrixXd::Identity(kUnknowns, kUnknowns));
  Solution s;
  s.value = scale.asDiagonal() *
            Eigen::VectorXd(factors.solve(scale.asDiagonal() *
                                          Eigen::VectorXd(windows.motion.transpose() * force)));
  const Eigen::VectorXd residual = force - windows.motion * s.value;
  const double freedom =
      std::max(1.0, static_cast<double>(force.size()) - static_cast<double>(kUnknowns));
  const double variance = residual.squaredNorm() / freedom;
  s.rms = std::sqrt(variance);
  s.spread =
      variance * (scale.asDiagonal() *
                  Eigen::MatrixXd(factors.solve(Eigen::MatrixXd::Identity(kUnknowns, kUnknowns))) *
                  scale.asDiagonal());
  return s;
}

Eigen::VectorXd forces(const std::vector<IdentificationSample>& samples, const Windows& windows,
                       std::size_t half, double period_s, double delay_s) {
  Eigen::VectorXd sums(static_cast<Eigen::Index>(windows.centre.size()));
  for (Eigen::Index i = 0; i < sums.size(); ++i) {
    sums[i] =
        force_around(samples, windows.centre[static_cast<std::size_t>(i)], half, period_s, delay_s);
  }
  return sums;
}

struct DelayFit {
  double delay_s = 0.0;
  Solution solution;
  double explained = 0.0;  ///< share of the forces that follows from the motion
};
constexpr double kLeastExplained = 0.9;

/// The delay with the smallest residual: coarse, then fine.
DelayFit fit_delay(const std::vector<IdentificationSample>& samples, const Windows& windows,
                   std::size_t half, double period_s) {
  DelayFit fit;
  const auto misfit = [&](double delay_s) {
    return solve(windows, forces(samples, windows, half, period_s, delay_s)).rms;
  };
  double best = std::numeric_limits<double>::infinity();
  const auto search = [&](double from_s, double to_s, double by_s) {
    for (double d = from_s; d <= to_s + 1e-12; d += by_s) {
      if (const double rms = misfit(d); rms < best) {
        best = rms;
        fit.delay_s = d;
      }
    }
  };
  search(0.0, kLongestDelay_s, period_s);
  const double coarse_s = fit.delay_s;
  search(std::max(0.0, coarse_s - period_s), coarse_s + period_s, 0.05 * period_s);
  const Eigen::VectorXd force = forces(samples, windows, half, period_s, fit.delay_s);
  fit.solution = solve(windows, force);
  fit.explained = 1.0 - fit.solution.rms * fit.solution.rms * static_cast<double>(force.size()) /
                            std::max(force.squaredNorm(), 1e-300);
  return fit;
}

/// Windows of 2 half + 1 samples, `apart` samples from each other, without missed periods.
Windows windows_of(const std::vector<IdentificationSample>& samples, std::size_t half,
                   std::size_t margin, std::size_t apart, double period_s, double least_m) {
  Windows windows;
  std::vector<Eigen::RowVectorXd> rows;
  for (std::size_t c = margin; c + margin < samples.size(); c += apart) {
    if (!is_covered(samples, c - margin, c + half)) continue;
    windows.centre.push_back(c);
    rows.push_back(motion_around(samples, c, half, period_s, least_m));
  }
  windows.motion.resize(static_cast<Eigen::Index>(rows.size()), kUnknowns);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    windows.motion.row(static_cast<Eigen::Index>(i)) = rows[i];
  }
  return windows;
}

struct Lengths {
  std::size_t half, margin;
};
Lengths lengths_of(double period_s) {
  const auto half = static_cast<std::size_t>(std::lround(0.5 * kVelocityWindow_s / period_s));
  const auto longest = static_cast<std::size_t>(std::lround(kLongestDelay_s / period_s));
  return {half, half + longest + 16};
}

double stroke_of(const std::vector<IdentificationSample>& samples) {
  const auto [low, high] = std::minmax_element(
      samples.begin(), samples.end(), [](const auto& a, const auto& b) { return a.at_m < b.at_m; });
  return high->at_m - low->at_m;
}
constexpr double kFewestSteps = 20.0;

}  // namespace

std::optional<double> checked_delay_s(const std::vector<IdentificationSample>& samples,
                                      double period_s) {
  const auto [half, margin] = lengths_of(period_s);
  if (samples.size() < 2 * margin + half) return std::nullopt;
  const double step_m = step_of(samples).value_or(noise_of(samples) * std::sqrt(12.0));
  const double stroke_m = stroke_of(samples);
  if (!(stroke_m >= kFewestSteps * step_m) || stroke_m <= 0.0) return std::nullopt;
  const Windows windows =
      windows_of(samples, half, margin, std::max<std::size_t>(1, half / 8), period_s, 2.0 * step_m);
  if (windows.centre.size() < kFewestWindows) return std::nullopt;
  const DelayFit fit = fit_delay(samples, windows, half, period_s);
  if (!(fit.explained > kLeastExplained) || !(fit.solution.value[0] > 0.0)) return std::nullopt;
  return fit.delay_s;
}

IdentifyingForce::IdentifyingForce(double period_s, std::uint64_t seed) noexcept
    : period_s_(period_s), state_(seed * 2862933555777941757ULL + 3037000493ULL) {}

double IdentifyingForce::next_N(double at_m) noexcept {
  if (--left_ <= 0) {
    // An irregular time until the next edge.
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const double even = static_cast<double>(state_ >> 11U) / 9007199254740992.0;
    left_ =
        static_cast<int>((kShortestBit_s + (kLongestBit_s - kShortestBit_s) * even) / period_s_);
    sign_ = -sign_;
  }
  return std::clamp(sign_ * kEdge_N - kCentring_N_per_m * at_m, -kMostIdentifyingForce_N,
                    kMostIdentifyingForce_N);
}

DeviceIdentification identify_device(const std::vector<IdentificationSample>& samples,
                                     double period_s) {
  DeviceIdentification found;
  found.resolution_s = 0.5 * period_s;
  const auto [half, margin] = lengths_of(period_s);
  if (samples.size() < 2 * margin + half) {
    found.not_identified.emplace_back("everything: the measurement is too short");
    return found;
  }
  found.stroke_m = stroke_of(samples);
  found.encoder_step_m = step_of(samples);
  found.noise_m = noise_of(samples);
  const double step_m = found.encoder_step_m.value_or(found.noise_m * std::sqrt(12.0));
  if (!found.encoder_step_m) {
    found.not_identified.emplace_back("encoder step: changes of the position have no common step");
  }
  if (!(found.stroke_m >= kFewestSteps * step_m) || found.stroke_m <= 0.0) {
    found.not_identified.push_back(
        fmt::format("delay, friction, mass: the stroke of {} mm is below {} steps of the encoder",
                    significant(1e3 * found.stroke_m, 3), kFewestSteps));
    return found;
  }
  const double least_m = 2.0 * step_m;
  const Windows windows = windows_of(samples, half, margin, half, period_s, least_m);
  if (windows.centre.size() < kFewestWindows) {
    found.not_identified.emplace_back(
        "delay, friction, mass: too many periods were missed (tpm hil check)");
    return found;
  }
  const DelayFit fit = fit_delay(samples, windows, half, period_s);
  const double delay_s = fit.delay_s, explained = fit.explained;
  const Solution& s = fit.solution;
  if (!(explained > kLeastExplained) || !(s.value[0] > 0.0)) {
    found.not_identified.push_back(fmt::format(
        "delay, friction, mass: the motion follows from the forces to {} % only; something else "
        "moves the handle",
        significant(100.0 * std::max(explained, 0.0), 2)));
    return found;
  }
  // Each edge has a delay of its own.
  std::vector<double> delays;
  for (std::size_t i = margin; i + margin < samples.size(); ++i) {
    const double jump = samples[i].force_N - samples[i - 1].force_N;
    if (std::abs(jump) < kEdge_N) continue;
    const auto late = static_cast<std::size_t>(std::lround(delay_s / period_s));
    const std::size_t c = i + late;
    if (c + margin >= samples.size() || !is_covered(samples, i - half, c + half)) continue;
    const double seen = motion_around(samples, c, half, period_s, least_m).dot(s.value);
    const double meant = force_around(samples, c, half, period_s, delay_s);
    const double off =
        (static_cast<double>(i) * period_s + delay_s - static_cast<double>(c) * period_s) /
        (static_cast<double>(half) * period_s);
    delays.push_back(delay_s + (meant - seen) / (jump * bump(off)));
  }
  if (delays.size() < 10) {
    found.not_identified.emplace_back("delay: too few edges of the force were served in time");
    return found;
  }
  double sum = 0.0, squares = 0.0;
  for (const double d : delays) sum += d;
  const double mean = sum / static_cast<double>(delays.size());
  for (const double d : delays) squares += (d - mean) * (d - mean);
  found.edges = static_cast<int>(delays.size());
  found.delay_mean_s = std::max(0.0, mean);
  found.delay_largest_s =
      std::max(*found.delay_mean_s, *std::max_element(delays.begin(), delays.end()));
  found.delay_jitter_s = std::sqrt(squares / static_cast<double>(delays.size() - 1));
  // Neighbouring windows overlap by half: twice the variance for as many independent ones. The
  // limit of friction is that of 99 %: errors of friction that rubs are not quite those of least
  // squares, and simulated devices need this for 95 %
  // (tests/haptics/test_device_identification.cpp).
  constexpr double kOverlap = 2.0, kOneSided = 2.33, kBothSides = 1.96;
  const auto error = [&](Eigen::Index i) { return std::sqrt(kOverlap * s.spread(i, i)); };
  found.viscous_N_s_per_m = s.value[1];
  constexpr double kSums = 0.98;  // sums over samples are not quite the integrals
  found.viscous_lower_95_N_s_per_m = std::max(0.0, kSums * s.value[1] - kOneSided * error(1));
  found.coulomb_low_N = std::max(0.0, s.value[2] - kBothSides * error(2));
  found.coulomb_high_N = std::max(0.0, s.value[2] + kBothSides * error(2));
  found.held_N_per_m = s.value[3];
  found.mass_kg = s.value[0];
  constexpr double kWithin = 0.1, kMostStep_m = 10.5e-6, kMostCoulomb_N = 0.05;
  // The centring spring is a part of the forces: what is left of stiffness is a hand's.
  const bool free = std::abs(s.value[3]) < std::max(3.0, kBothSides * error(3));
  found.mass_certain = free && step_m <= kMostStep_m && *found.coulomb_high_N <= kMostCoulomb_N &&
                       kBothSides * error(0) < kWithin * s.value[0];
  const double margin_kg = std::max(kWithin * s.value[0], kBothSides * error(0));
  found.mass_low_kg = std::max(0.0, s.value[0] - margin_kg);
  found.mass_high_kg = s.value[0] + margin_kg;
  return found;
}

}  // namespace tpm::haptics
