#include "tpm/fit/recording/placement.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/likelihood/quantum.hpp"
#include "tpm/fit/recording/pull_after_withdrawal.hpp"
#include "tpm/fit/recording/rest_line.hpp"
#include "tpm/fit/spikes_at_rest.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kMostAtRest = 1000;  // samples, or blocks of them
constexpr std::size_t kFewestForSlope = 8;
constexpr std::size_t kFewestForNoise = 4;
constexpr double kFarOff = 8.0, kOfMedian = 1.4826;  // robust standard deviations

/// Readings of the rests, one behind the other.
struct RestSamples {
  std::vector<double> time_s, reading;
  std::size_t before = 0, after = 0;
};

double travel_of(const PreparedRecording& r) {
  return r.phases.peak_drive - r.phases.contact_drive;
}

std::size_t peak_drive_index(const PreparedRecording& r) {
  const std::vector<double>& drive = r.recording.drive;
  return static_cast<std::size_t>(std::ranges::max_element(drive) - drive.begin());
}

/// Largest error of a drive at rest, and distance that it needs in the air while it moves.
struct Clear {
  double tolerance = 0.0, far = 0.0;
};

Clear clear_of(const PreparedRecording& r) {
  constexpr double kStill = 1e-4, kFar = 0.1;  // of the travel
  const double travel = travel_of(r);
  return {std::max(4.0 * r.phases.drive_jitter_sd, kStill * travel),
          r.phases.contact_drive - kFar * travel};
}

/// Samples after the deepest one in which the drive stays withdrawn. Where cycles turn, or the
/// recording ends, before that is a rest, the tissue need not have left the probe.
std::vector<std::size_t> withdrawn_samples(const PreparedRecording& r, double back, bool rested) {
  const std::vector<double>& drive = r.recording.drive;
  std::vector<std::size_t> withdrawn;
  std::size_t begin = 0;  // of the run
  for (std::size_t i = peak_drive_index(r); i <= drive.size(); ++i) {
    if (i < drive.size() && drive[i] <= back) {
      withdrawn.push_back(i);
      continue;
    }
    const bool turns = i < drive.size() || rested;
    if (turns && withdrawn.size() - begin < kFewestForSlope) withdrawn.resize(begin);
    begin = withdrawn.size();
  }
  return withdrawn;
}

RestSamples rest_samples(const PreparedRecording& r) {
  constexpr double kRecoil = 0.1;  // of the rest after withdrawal, which is left out
  RestSamples rest;
  const std::vector<double>& drive = r.recording.drive;
  const Clear clear = clear_of(r);
  const auto take = [&](std::size_t i) {
    rest.time_s.push_back(r.recording.time_s[i]);
    rest.reading.push_back(r.recording.response[i]);
  };
  const bool touched = r.phases.contact_found && !r.phases.preloaded;
  bool resting = touched;
  for (std::size_t i = 0; touched && i <= r.phases.contact_index; ++i) {
    resting = resting && std::abs(drive[i] - drive.front()) <= clear.tolerance;
    if (!resting && drive[i] > clear.far) continue;
    take(i);
    ++rest.before;
  }
  const double back = touched ? std::max(clear.far, drive.front() + clear.tolerance) : clear.far;
  const std::vector<std::size_t> withdrawn =
      withdrawn_samples(r, back, rest.before >= kFewestForSlope);
  const auto recoil = static_cast<std::size_t>(kRecoil * static_cast<double>(withdrawn.size()));
  for (std::size_t k = recoil; k < withdrawn.size(); ++k) take(withdrawn[k]);
  rest.after = withdrawn.size() - recoil;
  return rest;
}

/// Without single readings far off, which are no noise about the zero (as isolated_outliers).
RestSamples without_outliers(RestSamples rest) {
  const std::vector<bool> spikes = spikes_at_rest(rest.reading);
  RestSamples kept;
  kept.before = rest.before;
  kept.after = rest.after;
  for (std::size_t i = 0; i < rest.reading.size(); ++i) {
    if (spikes[i]) continue;
    kept.time_s.push_back(rest.time_s[i]);
    kept.reading.push_back(rest.reading[i]);
  }
  return kept;
}

/// Spread of readings about the straight line of least squares through them.
double spread_about_line(std::span<const double> time_s, std::span<const double> reading) {
  Eigen::MatrixXd line(static_cast<Eigen::Index>(reading.size()), 2);
  Eigen::VectorXd y(line.rows());
  for (std::size_t i = 0; i < reading.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    line.row(row) << 1.0, time_s[i] - time_s.front();
    y[row] = reading[i] - reading.front();
  }
  const Eigen::VectorXd off = (y - line * line.colPivHouseholderQr().solve(y)).cwiseAbs();
  return kOfMedian * median({off.begin(), off.end()});  // robust
}

/// Without the readings after withdrawal where they move on by much more than the noise of the rest
/// before contact: a specimen that is bonded to the probe recovers there.
RestSamples without_recovery(RestSamples rest, double rounding) {
  constexpr std::size_t kEnough = 20;  // samples that tell the noise
  constexpr double kAlike = 4.0;       // in spread
  if (rest.before < kEnough || rest.after < kFewestForSlope) return rest;
  const std::span<const double> time = rest.time_s, reading = rest.reading;
  const double before = spread_about_line(time.first(rest.before), reading.first(rest.before));
  const double after = spread_about_line(time.subspan(rest.before), reading.subspan(rest.before));
  if (after <= kAlike * std::max(before, rounding)) return rest;
  rest.time_s.resize(rest.before);
  rest.reading.resize(rest.before);
  rest.after = 0;
  return rest;
}

/// Means of blocks, where there are many samples.
RestSamples averaged(RestSamples rest) {
  const std::size_t n = rest.reading.size();
  if (n <= kMostAtRest) return rest;
  const std::size_t block = (n + kMostAtRest - 1) / kMostAtRest;
  RestSamples few;
  few.before = rest.before;
  few.after = rest.after;
  for (std::size_t i = 0; i + block <= n; i += block) {
    double time = 0.0, reading = 0.0;
    for (std::size_t k = i; k < i + block; ++k) {
      time += rest.time_s[k] / static_cast<double>(block);
      reading += rest.reading[k] / static_cast<double>(block);
    }
    few.time_s.push_back(time);
    few.reading.push_back(reading);
  }
  return few;
}

/// Rounding hides what is smaller than a step.
double rounding_sd(const PreparedRecording& r) {
  constexpr double kLeast = 1e-9;  // of the peak: rounding of numbers
  const double quantum = quantum_of(r.recording.response);
  const double stated = r.instrument ? r.instrument->reading_floor() : 0.0;
  return std::max({quantum / std::sqrt(12.0), stated, kLeast * std::abs(r.phases.peak_response)});
}

std::optional<HoldSamples> hold_samples(const PreparedRecording& r) {
  constexpr std::size_t kFewest = 50, kMost = 1000;
  const Phase* longest = nullptr;
  for (const Phase& phase : r.phases.phases) {
    if (phase.kind != PhaseKind::hold || phase.first < r.phases.contact_index) continue;
    if (longest == nullptr || phase.last - phase.first > longest->last - longest->first) {
      longest = &phase;
    }
  }
  if (longest == nullptr || longest->last - longest->first < kFewest) return std::nullopt;
  // The fast beginning is left out.
  const std::size_t held = longest->last - longest->first;
  const std::size_t n = std::min(held - held / 10, kMost);
  const std::size_t first = longest->last + 1 - n;
  const std::span<const double> time(&r.recording.time_s[first], n);
  Eigen::MatrixXd j(static_cast<Eigen::Index>(n), 6);
  Eigen::VectorXd y(j.rows());
  for (std::size_t i = 0; i < n; ++i) {
    const double x = (time[i] - time.front()) / (time.back() - time.front());
    const auto row = static_cast<Eigen::Index>(i);
    j.row(row) << 1.0, x, std::exp(-2.0 * x), std::exp(-6.0 * x), std::exp(-18.0 * x),
        std::exp(-54.0 * x);
    y[row] = r.recording.response[first + i] - r.recording.response[longest->last];
  }
  if (!(y.cwiseAbs().maxCoeff() > 0.0)) return std::nullopt;
  const double step_s = median_step(time);
  // Single readings far off the curve are no noise here either.
  const Eigen::VectorXd off = (y - j * j.colPivHouseholderQr().solve(y)).cwiseAbs();
  const double far = kFarOff * kOfMedian * median({off.begin(), off.end()});
  std::vector<Eigen::Index> kept;
  std::vector<double> kept_time;
  for (Eigen::Index i = 0; i < off.size(); ++i) {
    if (far > 0.0 && off[i] > far) continue;
    kept.push_back(i);
    kept_time.push_back(time[static_cast<std::size_t>(i)]);
  }
  // Many of them are no single readings: a clipped hold, for one. What is left then need not tell
  // the exponentials apart either.
  constexpr Eigen::Index kSeldom = 10;
  if (kSeldom * (off.size() - std::ssize(kept)) > off.size()) return std::nullopt;
  const Eigen::VectorXd reading = y(kept);
  const Eigen::MatrixXd curve = j(kept, Eigen::all);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(curve);
  if (qr.rank() < curve.cols() || !((reading - curve * qr.solve(reading)).norm() > 0.0)) {
    return std::nullopt;
  }
  const double variance = estimate_autoregression(kept_time, reading, curve, step_s).variance;
  return HoldSamples{std::move(kept_time), reading, curve, step_s, variance};
}

/// Estimates from rests, and the standard deviations of zero and drift at the upper end of the 95 %
/// interval of the noise.
struct RestEstimate {
  RestReadings readings;
  double zero_limit = 0.0, drift_limit = 0.0;
};

/// A line (below 8 samples a level) through readings at rest.
/// @param hold whose noise is that of the rests
void fit_rests(const RestSamples& rest, double rounding, const std::optional<HoldSamples>& hold,
               RestEstimate& estimate) {
  const bool sloped = rest.reading.size() >= kFewestForSlope;
  const RestLine line =
      fit_rest_line(rest.time_s, rest.reading, sloped, rounding, hold ? &*hold : nullptr);
  RestReadings& result = estimate.readings;
  result.phi = line.phi;
  result.noise_sd = line.noise_sd;
  result.origin_s = line.origin_s;
  result.zero = line.zero;
  result.drift = line.slope;
  result.telling_drift_sd = line.telling_slope_sd;
  estimate.zero_limit = line.zero_limit;
  estimate.drift_limit = line.slope_limit;
}

RestEstimate estimate_rests(const PreparedRecording& recording) {
  constexpr double kShort = 100.0;  // samples, below which a longer hold tells the noise
  RestEstimate estimate;
  RestReadings& result = estimate.readings;
  const double rounding = rounding_sd(recording);
  RestSamples all = without_recovery(rest_samples(recording), rounding);
  const std::span<const double> time = all.time_s, reading = all.reading;
  result.pulled = is_pulled_after({time.first(all.before), reading.first(all.before)},
                                  {time.subspan(all.before), reading.subspan(all.before)});
  if (result.pulled) {
    all.time_s.resize(all.before);
    all.reading.resize(all.before);
    all.after = 0;
  }
  result.before = all.before;
  result.after = all.after;
  if (all.reading.empty() || (all.before == 0 && all.after < kFewestForSlope)) return estimate;
  const RestSamples rest = averaged(without_outliers(all));
  const auto n = static_cast<double>(rest.reading.size());
  const double level = middle_of_rest(rest.reading);
  double squares = 0.0;
  for (const double v : rest.reading) squares += (v - level) * (v - level);
  const bool constant = rest.reading.size() > 2 && squares <= n * rounding * rounding * 1e-6;
  const std::optional<HoldSamples> hold =
      n < kShort && !constant ? hold_samples(recording) : std::nullopt;
  // A hold that no such curve describes has no noise to be read.
  constexpr double kAlike = 16.0;  // in variance
  const bool alike = rest.reading.size() < kFewestForNoise ||
                     (hold && hold->variance * (n - 1.0) <= kAlike * squares);
  const auto within = [&](double t) {
    return t >= hold->time_s.front() && t <= hold->time_s.back();
  };
  const bool longer = hold && alike && hold->time_s.size() > rest.reading.size() &&
                      std::ranges::none_of(rest.time_s, within);  // a rest may be held, too
  if ((longer || rest.reading.size() >= kFewestForNoise) && !constant) {
    // The square of half a step is three times the variance of rounding.
    const double hidden = 3.0 * rounding * rounding * hidden_noise_variance(n - 1.0);
    fit_rests(rest, squares < (n - 1.0) * hidden ? rounding : 0.0, longer ? hold : std::nullopt,
              estimate);
    return estimate;
  }
  const double noise = std::max(recording.phases.noise_sd_estimate, rounding);
  const double length = rest.time_s.back() - rest.time_s.front();
  result.origin_s = middle_of_rest(rest.time_s);
  result.noise_sd = constant ? rounding : noise;
  result.zero = Measured{level, constant ? rounding : noise / std::sqrt(n)};
  if (constant && rest.reading.size() >= kFewestForSlope) {
    result.drift = Measured{0.0, std::sqrt(12.0) * rounding / length};
    result.telling_drift_sd = result.drift->sd;
  }
  return estimate;
}

/// The largest standard deviation of a drift that rests tell; 0 if they have none, nothing where
/// nothing is held.
std::optional<double> most_drift_sd(const PreparedRecording& r, const RestReadings& rests) {
  constexpr double kShare = 0.02;  // of the relaxed force
  const std::vector<double>& time = r.recording.time_s;
  double hold_s = 0.0;
  std::size_t end = 0;
  for (const Phase& phase : r.phases.phases) {
    const bool fitted = time[phase.last] > r.from_s && time[phase.first] < r.to_s;
    const bool loaded = phase.first >= r.phases.contact_index;
    if (phase.kind != PhaseKind::hold || !fitted || !loaded) continue;
    if (phase.first == 0 && r.phases.phases.size() > 1) continue;  // a preload at rest
    const double length = time[phase.last] - time[phase.first];
    if (length > hold_s) end = phase.last;
    hold_s = std::max(hold_s, length);
  }
  // The drift acts from contact on.
  const double loaded_s = time[end] - time[r.phases.contact_index];
  if (hold_s == 0.0) return std::nullopt;
  if (!rests.drift || !rests.zero) return 0.0;
  const double zero = rests.zero->value + rests.drift->value * (time[end] - rests.origin_s);
  return kShare * std::abs(r.recording.response[end] - zero) / loaded_s;
}

}  // namespace

std::size_t samples_before_contact(const PreparedRecording& recording) {
  return rest_samples(recording).before;
}

RestReadings read_rests(const PreparedRecording& recording) {
  return estimate_rests(recording).readings;
}

std::optional<LevelBeforeLoad> level_before_load(const PreparedRecording& r) {
  constexpr double kUnloaded = 1e-3;  // of the range of the drive
  const Recording& recording = r.recording;
  const std::vector<Phase>& phases = r.phases.phases;
  if (law_drive(recording) != Quantity::strain || phases.size() < 2 ||
      phases.front().kind != PhaseKind::hold) {
    return std::nullopt;
  }
  const std::size_t count = phases.front().last + 1;
  if (count < kFewestForNoise || r.from_s <= recording.time_s[count - 1]) return std::nullopt;
  const auto first = [count](const std::vector<double>& values) {
    return std::vector<double>(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
  };
  const auto [low, high] = std::ranges::minmax_element(recording.drive);
  const double still = std::max(kUnloaded * (*high - *low), 4.0 * r.phases.drive_jitter_sd);
  if (std::abs(middle_of_rest(first(recording.drive))) > still) return std::nullopt;
  const RestSamples rest{first(recording.time_s), first(recording.response), count, 0};
  const double level = middle_of_rest(rest.reading), rounding = rounding_sd(r);
  double squares = 0.0;
  for (const double v : rest.reading) squares += (v - level) * (v - level);
  const auto n = static_cast<double>(count);
  if (squares <= n * rounding * rounding * 1e-6) return LevelBeforeLoad{{level, rounding}, count};
  RestEstimate estimate;
  fit_rests(averaged(without_outliers(rest)),
            squares < n * 4.0 * rounding * rounding ? rounding : 0.0, std::nullopt, estimate);
  return LevelBeforeLoad{estimate.readings.zero.value(), count};
}

DriftFinding drift_finding(const PreparedRecording& r, const RestReadings& rests) {
  const auto most = most_drift_sd(r, rests);
  if (!most) return DriftFinding::no_hold;
  const bool told = rests.drift && rests.telling_drift_sd <= *most;
  return told ? DriftFinding::told : DriftFinding::not_separable;
}

MeasuredPlacement measure_placement(const PreparedRecording& recording, const LawSpec& law,
                                    std::optional<double> exponent) {
  MeasuredPlacement placement;
  const RestEstimate estimate = estimate_rests(recording);
  RestReadings& rests = placement.rests;
  rests = estimate.readings;
  placement.onset = find_onset(recording, rests, first_loading_exponent(law, exponent));
  placement.drift = drift_finding(recording, rests);
  // An estimate of the noise that is small by chance makes a drift told, too: where a larger one,
  // which the readings do not exclude, would not, what was chosen by it is stated with that one.
  if (placement.drift == DriftFinding::told &&
      estimate.drift_limit > most_drift_sd(recording, rests).value_or(0.0)) {
    rests.drift->sd = std::max(rests.drift->sd, estimate.drift_limit);
    rests.zero->sd = std::max(rests.zero->sd, estimate.zero_limit);
  }
  return placement;
}

const MeasuredPlacement& PlacementMemory::of(const PreparedRecording& recording, const LawSpec& law,
                                             std::optional<double> of_probe) {
  const Key key{recording.name, recording.from_s, recording.to_s,
                first_loading_exponent(law, of_probe)};
  const auto found = measured_.find(key);
  if (found != measured_.end()) return found->second;
  return measured_.emplace(key, measure_placement(recording, law, of_probe)).first->second;
}

}  // namespace tpm::fit
