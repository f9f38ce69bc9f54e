#include "tpm/haptics/session/handle_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"

namespace tpm::haptics {
namespace {

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

constexpr std::size_t kSlope = 8;  // periods over which the sign of a motion is taken

/// Motion in the middle of a window of 2 half + 1 periods, as m, b, c, k and f multiply it.
Eigen::RowVectorXd motion_around(const HandleTimeline& line, std::size_t centre, std::size_t half,
                                 double least_m) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(kHandleUnknowns);
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
double force_around(const HandleTimeline& line, std::size_t centre, std::size_t half,
                    double delay_s) {
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

HandleSolution solve(const HandleWindows& windows, const Eigen::VectorXd& force) {
  const Eigen::MatrixXd normal = windows.motion.transpose() * windows.motion;
  // Columns differ by orders of magnitude.
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> factors(
      scaled + 1e-12 * Eigen::MatrixXd::Identity(kHandleUnknowns, kHandleUnknowns));
  HandleSolution s;
  s.value = scale.asDiagonal() *
            Eigen::VectorXd(factors.solve(scale.asDiagonal() *
                                          Eigen::VectorXd(windows.motion.transpose() * force)));
  const Eigen::VectorXd residual = force - windows.motion * s.value;
  const double freedom =
      std::max(1.0, static_cast<double>(force.size()) - static_cast<double>(kHandleUnknowns));
  const double variance = residual.squaredNorm() / freedom;
  s.rms = std::sqrt(variance);
  s.spread =
      variance *
      (scale.asDiagonal() *
       Eigen::MatrixXd(factors.solve(Eigen::MatrixXd::Identity(kHandleUnknowns, kHandleUnknowns))) *
       scale.asDiagonal());
  return s;
}

Eigen::VectorXd forces(const HandleTimeline& line, const HandleWindows& windows, std::size_t half,
                       double delay_s) {
  Eigen::VectorXd sums(static_cast<Eigen::Index>(windows.centre.size()));
  for (Eigen::Index i = 0; i < sums.size(); ++i) {
    sums[i] = force_around(line, windows.centre[static_cast<std::size_t>(i)], half, delay_s);
  }
  return sums;
}

}  // namespace

HandleTimeline timeline_of(const std::vector<IdentificationSample>& samples, double period_s) {
  HandleTimeline line;
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

double noise_of(const HandleTimeline& line) {
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

DelayFit fit_delay(const HandleTimeline& line, const HandleWindows& windows, std::size_t half) {
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

HandleWindows windows_of(const HandleTimeline& line, std::size_t half, std::size_t margin,
                         std::size_t apart, double least_m) {
  HandleWindows windows;
  std::vector<Eigen::RowVectorXd> rows;
  for (std::size_t c = margin; c + margin < line.size(); c += apart) {
    ++windows.tried;
    if (!line.covers(c - half - kSlope, c + half + kSlope)) continue;
    windows.centre.push_back(c);
    rows.push_back(motion_around(line, c, half, least_m));
  }
  windows.motion.resize(static_cast<Eigen::Index>(rows.size()), kHandleUnknowns);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    windows.motion.row(static_cast<Eigen::Index>(i)) = rows[i];
  }
  return windows;
}

WindowLengths window_lengths(double period_s) {
  const auto half = static_cast<std::size_t>(std::lround(0.5 * kVelocityWindow_s / period_s));
  const auto longest = static_cast<std::size_t>(std::lround(kSearchedDelay_s / period_s));
  return {half, half + longest + 16};
}

std::vector<double> edge_delays(const HandleTimeline& line, const DelayFit& fit,
                                const WindowLengths& lengths, double least_m) {
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

}  // namespace tpm::haptics
