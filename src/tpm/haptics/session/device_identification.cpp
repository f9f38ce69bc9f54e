#include "tpm/haptics/session/device_identification.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/device/device_limits.hpp"

namespace tpm::haptics {
namespace {

constexpr double kVelocityWindow_s = 0.064, kSearchedDelay_s = 0.050;
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
  std::size_t tried = 0;
  std::vector<std::size_t> centre;  ///< periods
  Eigen::MatrixXd motion;           ///< a row each, kUnknowns columns
  double half_s = 0.0;
};

/// What was measured, on the grid of periods.
struct Timeline {
  double period_s = 0.0;
  std::vector<double> at_m;             ///< a period each
  std::vector<std::size_t> gap;         ///< periods of the grid before each that are not known
  std::vector<double> sent_s, force_N;  ///< commands, in their order
  int stalls = 0;
  double stalled_s = 0.0;

  [[nodiscard]] std::size_t size() const { return at_m.size(); }
  /// Whether all of `from` to `to` is known.
  [[nodiscard]] bool covers(std::size_t from, std::size_t to) const {
    return gap[to + 1] == gap[from];
  }
};

/// Positions between readings that are close to each other, and when each command was sent.
Timeline timeline_of(const std::vector<IdentificationSample>& samples, double period_s) {
  Timeline line;
  line.period_s = period_s;
  std::vector<double> read_s, read_m;
  double period = -1.0;
  for (const IdentificationSample& sample : samples) {
    period += 1.0 + sample.missed;
    // A reading is never earlier than the one before, whatever the clock says.
    const double now_s =
        std::max(period * period_s + sample.late_s, line.sent_s.empty() ? 0.0 : line.sent_s.back());
    line.sent_s.push_back(now_s);
    line.force_N.push_back(sample.force_N);
    if (sample.stale) continue;
    if (!read_s.empty() && now_s <= read_s.back()) continue;
    read_s.push_back(now_s);
    read_m.push_back(sample.at_m);
  }
  line.gap.push_back(0);
  if (read_s.empty()) return line;
  const auto periods = static_cast<std::size_t>(period) + 1;
  const double longest_s = kLongestBridge_s + 0.5 * period_s;
  std::size_t next = 0;
  bool stalled = false;
  for (std::size_t i = 0; i < periods; ++i) {
    const double time_s = static_cast<double>(i) * period_s;
    while (next < read_s.size() && read_s[next] < time_s - 1e-9) ++next;
    const bool exact = next < read_s.size() && read_s[next] <= time_s + 1e-9;
    const bool between = next > 0 && next < read_s.size();
    const bool known = exact || (between && read_s[next] - read_s[next - 1] <= longest_s);
    double at_m = next < read_s.size() ? read_m[next] : read_m.back();
    if (!exact && between) {
      const double part = (time_s - read_s[next - 1]) / (read_s[next] - read_s[next - 1]);
      at_m = read_m[next - 1] + part * (read_m[next] - read_m[next - 1]);
    }
    line.at_m.push_back(at_m);
    line.gap.push_back(line.gap.back() + (known ? 0 : 1));
    const bool counts = !known && between;  // not the first and the last period
    if (counts && !stalled) ++line.stalls;
    if (counts) line.stalled_s += period_s;
    stalled = counts;
  }
  return line;
}

constexpr std::size_t kSlope = 8;  // periods over which the sign of a motion is taken

/// Motion in the middle of a window of 2 half + 1 periods, as m, b, c, k and f multiply it.
Eigen::RowVectorXd motion_around(const Timeline& line, std::size_t centre, std::size_t half,
                                 double least_m) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(kUnknowns);
  const double period_s = line.period_s, half_s = static_cast<double>(half) * period_s;
  for (std::size_t i = centre - half; i <= centre + half; ++i) {
    const double s =
        (static_cast<double>(i) - static_cast<double>(centre)) / static_cast<double>(half);
    const double x = line.at_m[i];
    const double moved = line.at_m[std::min(i + kSlope, line.size() - 1)] - line.at_m[i - kSlope];
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

/// The force over the window if it comes `delay_s` late; a command is held until the next one.
double force_around(const Timeline& line, std::size_t centre, std::size_t half, double delay_s) {
  const double half_s = static_cast<double>(half) * line.period_s;
  const double middle_s = static_cast<double>(centre) * line.period_s;
  const auto& sent = line.sent_s;
  const auto after = std::upper_bound(sent.begin(), sent.end(), middle_s - half_s - delay_s);
  auto i = static_cast<std::size_t>(after - sent.begin());
  if (i > 0) --i;
  double sum = 0.0;
  for (; i < sent.size(); ++i) {
    const double from = (sent[i] + delay_s - middle_s) / half_s;
    if (from > 1.0) break;
    const double until_s = i + 1 < sent.size() ? sent[i + 1] : sent[i] + line.period_s;
    const double to = (until_s + delay_s - middle_s) / half_s;
    sum += line.force_N[i] * (bump_area(to) - bump_area(from)) * half_s;
  }
  return sum;
}

/// The encoder's step: what nearly all small changes of the position are whole multiples of. Large
/// ones are near a multiple of anything.
std::optional<double> step_of(const std::vector<IdentificationSample>& samples) {
  constexpr double kLeast_m = 1e-9, kOff = 0.02, kNearlyAll = 0.99, kMostSteps = 10.0;
  constexpr std::size_t kFewest = 50;
  double least = std::numeric_limits<double>::infinity();
  std::size_t changes = 0, fitting = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double change = std::abs(samples[i].at_m - samples[i - 1].at_m);
    if (change > kLeast_m) least = std::min(least, change);
  }
  if (!std::isfinite(least)) return std::nullopt;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double steps = std::abs(samples[i].at_m - samples[i - 1].at_m) / least;
    if (steps < 0.5 || steps > kMostSteps) continue;
    ++changes;
    fitting += std::abs(steps - std::round(steps)) < kOff * std::max(1.0, steps) ? 1 : 0;
  }
  const bool one_step = changes >= kFewest &&
                        static_cast<double>(fitting) >= kNearlyAll * static_cast<double>(changes);
  return one_step ? std::optional(least) : std::nullopt;
}

/// From third differences, in which a smooth motion is lost: the variance of noise is theirs / 20.
double noise_of(const Timeline& line) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 3; i < line.size(); ++i) {
    if (!line.covers(i - 3, i)) continue;
    const double d =
        line.at_m[i] - 3.0 * line.at_m[i - 1] + 3.0 * line.at_m[i - 2] - line.at_m[i - 3];
    sum += d * d;
    count += 1.0;
  }
  return std::sqrt(sum / (20.0 * std::max(1.0, count)));
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

Eigen::VectorXd forces(const Timeline& line, const Windows& windows, std::size_t half,
                       double delay_s) {
  Eigen::VectorXd sums(static_cast<Eigen::Index>(windows.centre.size()));
  for (Eigen::Index i = 0; i < sums.size(); ++i) {
    sums[i] = force_around(line, windows.centre[static_cast<std::size_t>(i)], half, delay_s);
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
DelayFit fit_delay(const Timeline& line, const Windows& windows, std::size_t half) {
  DelayFit fit;
  const double period_s = line.period_s;
  const auto misfit = [&](double delay_s) {
    return solve(windows, forces(line, windows, half, delay_s)).rms;
  };
  double best = std::numeric_limits<double>::infinity();
  const auto search = [&](double from_s, double to_s, double by_s) {
    const auto steps = static_cast<int>(std::floor((to_s - from_s) / by_s + 1e-9));
    for (int i = 0; i <= steps; ++i) {
      const double delay_s = from_s + i * by_s;
      if (const double rms = misfit(delay_s); rms < best) {
        best = rms;
        fit.delay_s = delay_s;
      }
    }
  };
  search(0.0, kSearchedDelay_s, period_s);
  const double coarse_s = fit.delay_s;
  search(std::max(0.0, coarse_s - period_s), coarse_s + period_s, 0.05 * period_s);
  const Eigen::VectorXd force = forces(line, windows, half, fit.delay_s);
  fit.solution = solve(windows, force);
  fit.explained = 1.0 - fit.solution.rms * fit.solution.rms * static_cast<double>(force.size()) /
                            std::max(force.squaredNorm(), 1e-300);
  return fit;
}

/// Windows of 2 half + 1 periods, `apart` periods from each other, in which nothing stalled.
Windows windows_of(const Timeline& line, std::size_t half, std::size_t margin, std::size_t apart,
                   double least_m) {
  Windows windows;
  std::vector<Eigen::RowVectorXd> rows;
  for (std::size_t c = margin; c + margin < line.size(); c += apart) {
    ++windows.tried;
    if (!line.covers(c - half - kSlope, c + half + kSlope)) continue;
    windows.centre.push_back(c);
    rows.push_back(motion_around(line, c, half, least_m));
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
  const auto longest = static_cast<std::size_t>(std::lround(kSearchedDelay_s / period_s));
  return {half, half + longest + 16};
}

/// Each edge of the force has a delay of its own.
std::vector<double> edge_delays(const Timeline& line, const DelayFit& fit, const Lengths& lengths,
                                double least_m) {
  const auto [half, margin] = lengths;
  const double period_s = line.period_s;
  std::vector<double> delays;
  for (std::size_t i = 1; i < line.sent_s.size(); ++i) {
    const double jump = line.force_N[i] - line.force_N[i - 1];
    if (std::abs(jump) < kEdge_N) continue;
    const double acts_s = line.sent_s[i] + fit.delay_s;
    const auto c = static_cast<std::size_t>(std::lround(acts_s / period_s));
    if (c < margin || c + margin >= line.size()) continue;
    if (!line.covers(c - half - kSlope, c + half + kSlope)) continue;
    const double seen = motion_around(line, c, half, least_m).dot(fit.solution.value);
    const double meant = force_around(line, c, half, fit.delay_s);
    const double off =
        (acts_s - static_cast<double>(c) * period_s) / (static_cast<double>(half) * period_s);
    delays.push_back(fit.delay_s + (meant - seen) / (jump * bump(off)));
  }
  return delays;
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
  const Timeline line = timeline_of(samples, period_s);
  if (line.size() < 2 * margin + half) return std::nullopt;
  const double step_m = step_of(samples).value_or(noise_of(line) * std::sqrt(12.0));
  const double stroke_m = stroke_of(samples);
  if (!(stroke_m >= kFewestSteps * step_m) || stroke_m <= 0.0) return std::nullopt;
  const Windows windows =
      windows_of(line, half, margin, std::max<std::size_t>(1, half / 8), 2.0 * step_m);
  if (windows.centre.size() < kFewestWindows) return std::nullopt;
  const DelayFit fit = fit_delay(line, windows, half);
  if (!(fit.explained > kLeastExplained) || !(fit.solution.value[0] > 0.0)) return std::nullopt;
  const std::vector<double> delays = edge_delays(line, fit, {half, margin}, 2.0 * step_m);
  if (delays.empty()) return fit.delay_s;
  // Edges of a constant delay differ by noise of up to the resolution, also if a hand holds the
  // handle.
  const double largest_s = *std::max_element(delays.begin(), delays.end());
  return largest_s - fit.delay_s > 0.5 * period_s ? largest_s : fit.delay_s;
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
  const Timeline line = timeline_of(samples, period_s);
  if (line.size() < 2 * margin + half) {
    found.not_identified.emplace_back("everything: the measurement is too short");
    return found;
  }
  found.stroke_m = stroke_of(samples);
  found.encoder_step_m = step_of(samples);
  found.stalls = line.stalls;
  found.stalled_s = line.stalled_s;
  found.noise_m = noise_of(line);
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
  const Windows windows = windows_of(line, half, margin, half, least_m);
  if (windows.centre.size() < kFewestWindows) {
    found.not_identified.push_back(fmt::format(
        "delay, friction, mass: the loop or the device stalled too often: {} of {} windows of {} "
        "ms are whole, and {} are needed (tpm hil check)",
        windows.centre.size(), windows.tried, significant(1e3 * kVelocityWindow_s, 3),
        kFewestWindows));
    return found;
  }
  const DelayFit fit = fit_delay(line, windows, half);
  const double explained = fit.explained;
  const Solution& s = fit.solution;
  if (!(explained > kLeastExplained) || !(s.value[0] > 0.0)) {
    found.not_identified.push_back(fmt::format(
        "delay, friction, mass: the motion follows from the forces to {} % only; something else "
        "moves the handle",
        significant(100.0 * std::max(explained, 0.0), 2)));
    return found;
  }
  const std::vector<double> delays = edge_delays(line, fit, {half, margin}, least_m);
  if (delays.size() < 10) {
    found.not_identified.emplace_back(
        "delay: the loop or the device stalled at all but a few edges of the force (tpm hil "
        "check)");
    return found;
  }
  double sum = 0.0, squares = 0.0;
  for (const double d : delays) sum += d;
  const double mean = sum / static_cast<double>(delays.size());
  for (const double d : delays) squares += (d - mean) * (d - mean);
  found.edges = static_cast<int>(delays.size());
  found.delay_mean_s = std::max(0.0, mean);
  found.delay_jitter_s = std::sqrt(squares / static_cast<double>(delays.size() - 1));
  found.delay_largest_s = std::max({*found.delay_mean_s, *found.delay_jitter_s,
                                    *std::max_element(delays.begin(), delays.end())});
  // Neighbouring windows overlap by half: twice the variance for as many independent ones. The
  // limit of friction is that of 99 %: errors of friction that rubs are not quite those of least
  // squares, and simulated devices need this for 95 %
  // (tests/haptics/test_device_identification.cpp).
  constexpr double kOverlap = 2.0, kOneSided = 2.33, kBothSides = 1.96;
  const auto error = [&](Eigen::Index i) { return std::sqrt(kOverlap * s.spread(i, i)); };
  // The centring spring is a part of the forces: what is left of stiffness is a hand's.
  const bool free = std::abs(s.value[3]) < std::max(3.0, kBothSides * error(3));
  constexpr double kSums = 0.98;  // sums and signs over samples are not quite the integrals
  if (free) {
    found.viscous_N_s_per_m = s.value[1];
    found.viscous_lower_95_N_s_per_m =
        std::clamp(kSums * s.value[1] - kOneSided * error(1), 0.0, kMostHandleFriction_N_s_per_m);
  } else {
    // The damping of a hand is not friction of the device, and the gate would count it.
    found.not_identified.push_back(
        fmt::format("viscous friction: something holds the handle with {} N/m; let go of it",
                    significant(s.value[3], 3)));
  }
  const double coulomb_N = s.value[2];
  const double coulomb_margin_N = (1.0 - kSums) * std::abs(coulomb_N) + kBothSides * error(2);
  found.coulomb_low_N = std::max(0.0, coulomb_N - coulomb_margin_N);
  found.coulomb_high_N = std::max(0.0, coulomb_N + coulomb_margin_N);
  found.held_N_per_m = s.value[3];
  found.mass_kg = s.value[0];
  constexpr double kWithin = 0.1, kMostStep_m = 10.5e-6, kMostCoulomb_N = 0.05;
  found.mass_certain = free && step_m <= kMostStep_m && coulomb_N <= kMostCoulomb_N &&
                       kBothSides * error(0) < kWithin * s.value[0];
  const double margin_kg = std::max(kWithin * s.value[0], kBothSides * error(0));
  found.mass_low_kg = std::max(0.0, s.value[0] - margin_kg);
  found.mass_high_kg = s.value[0] + margin_kg;
  return found;
}

}  // namespace tpm::haptics
