#include "tpm/fit/select/unloading_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/work/give_up.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kFewestUnloading = 8;

bool is_testable(const FitResult& fit) {
  const FitConfig& config = fit.config;
  const bool memory = config.law && has_memory(*config.law);
  const bool plain = std::ranges::all_of(config.data, [](const DataChoice& d) {
    const bool of_share =
        d.noise.kind == NoiseKind::log || d.noise.kind == NoiseKind::relative_to_model;
    return d.noise.shape == ErrorShape::normal && !d.estimates_sigma() && !of_share;
  });
  return memory && plain && config.loss.kind == Loss::none && fit.covariance.full_rank &&
         threshold_of(fit).estimable();
}

/// Samples of the first unloading that are tested.
std::vector<std::size_t> tested_samples(const RecordingFit& r) {
  constexpr double kLeastShare = 0.2;  // of the peak above the response where the fit begins
  constexpr double kRise = 0.02;       // of the range of the drive
  constexpr std::size_t kMost = 500;   // the covariance of the noise has the square of it
  std::vector<std::size_t> samples;
  const auto first = std::ranges::find(r.fitted, true);
  if (first == r.fitted.end()) return samples;
  const auto last = std::find(r.fitted.rbegin(), r.fitted.rend(), true);
  const auto begin = static_cast<std::size_t>(first - r.fitted.begin());
  const auto end = static_cast<std::size_t>(r.fitted.rend() - last);
  double deepest = r.drive[begin], peak = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    deepest = std::max(deepest, r.drive[i]);
    if (!std::isfinite(r.predicted[i])) continue;
    const double rise = r.predicted[i] - r.predicted[begin];
    if (std::abs(rise) > std::abs(peak)) peak = rise;
  }
  if (peak == 0.0) return samples;
  double shallowest = deepest;
  for (std::size_t i = end; i < r.time_s.size() && r.drive[i] > r.drive[begin]; ++i) {
    if (r.drive[i] > shallowest + kRise * (deepest - r.drive[begin])) break;
    shallowest = std::min(shallowest, r.drive[i]);
    const double predicted = (r.predicted[i] - r.predicted[begin]) / peak;
    if (!(predicted > kLeastShare)) break;  // or no number
    if (r.is_censored(i) || r.outlier[i]) continue;
    if ((r.observed[i] - r.predicted[begin]) / peak <= kLeastShare) break;
    samples.push_back(i);
  }
  const std::size_t stride = samples.size() / kMost + 1;
  std::vector<std::size_t> some;
  for (std::size_t k = 0; k < samples.size(); k += stride) some.push_back(samples[k]);
  return some;
}

/// One row a block, which averages the samples in it.
Eigen::MatrixXd averaging_of(Eigen::Index samples) {
  constexpr Eigen::Index kMostBlocks = 10, kFewestInBlock = 4;
  const Eigen::Index blocks = std::clamp<Eigen::Index>(samples / kFewestInBlock, 1, kMostBlocks);
  Eigen::MatrixXd average = Eigen::MatrixXd::Zero(blocks, samples);
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const Eigen::Index from = b * samples / blocks, to = (b + 1) * samples / blocks;
    average.row(b).segment(from, to - from).setConstant(1.0 / static_cast<double>(to - from));
  }
  return average;
}

/// Sensitivity of standardised predictions to the free parameters in theta.
Eigen::MatrixXd scaled_sensitivity(const FitResult& fit, const RowMatrix& sensitivity,
                                   std::span<const Eigen::Index> rows,
                                   const Eigen::VectorXd& scale) {
  const auto& free = fit.covariance.free;
  Eigen::MatrixXd scaled(std::ssize(rows), std::ssize(free));
  for (Eigen::Index c = 0; c < scaled.cols(); ++c) {
    const std::size_t j = free[static_cast<std::size_t>(c)];
    const FitParameter& p = fit.parameters[j].parameter;
    const double slope = p.natural_slope(p.theta(fit.best.natural[j]));
    for (Eigen::Index k = 0; k < scaled.rows(); ++k) {
      const Eigen::Index row = rows[static_cast<std::size_t>(k)];
      scaled(k, c) = sensitivity(row, static_cast<Eigen::Index>(j)) * slope / scale[k];
    }
  }
  return scaled;
}

std::optional<UnloadingTest> test_of(const FitResult& fit, const ExperimentResiduals& function,
                                     const Experiment& experiment, const RecordingFit& r,
                                     const RowMatrix& sensitivity) {
  const std::vector<std::size_t> samples = tested_samples(r);
  if (samples.size() < kFewestUnloading) return std::nullopt;
  std::vector<Eigen::Index> rows;
  std::vector<double> time_s;
  Eigen::VectorXd off(std::ssize(samples)), scale(std::ssize(samples));
  double squares = 0.0;
  for (const std::size_t i : samples) {
    const std::size_t datum = experiment.data[i];
    const auto k = std::ssize(rows);
    scale[k] = function.new_noise_scale(datum, r.predicted[i], fit.best.natural);
    if (!(scale[k] > 0.0)) return std::nullopt;
    off[k] = (r.predicted[i] - r.observed[i]) / scale[k];
    rows.push_back(static_cast<Eigen::Index>(datum));
    time_s.push_back(r.time_s[i]);
    squares += (r.predicted[i] - r.observed[i]) * (r.predicted[i] - r.observed[i]);
  }
  // The variance of a slow mean is as 1 / (1 - phi)^2, and that of phi is (1 - phi^2) / n.
  const double n = fit.value_count;
  const double phi = fit.noise && fit.noise->correlated ? fit.noise->phi : 0.0;
  const double of_phi = phi > 0.0 ? 4.0 * (1.0 + phi) / ((1.0 - phi) * n) : 0.0;
  const double degrees = 2.0 / (of_phi + 2.0 / (n - static_cast<double>(fit.parameters.size())));
  if (!(degrees >= 1.0)) return std::nullopt;
  const double variance = fit.noise ? fit.noise->variance * fit.noise->beyond
                                    : threshold_of(fit).variance_factor(fit.best.deviance);
  const AutoregressiveNoise noise(phi, fit.noise ? fit.noise->step_s : median_step(r.time_s));
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(off.size(), off.size());
  for (Eigen::Index i = 0; i < off.size() && phi > 0.0; ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      const double apart =
          time_s[static_cast<std::size_t>(i)] - time_s[static_cast<std::size_t>(k)];
      correlation(i, k) = correlation(k, i) = noise.correlation(apart);
    }
  }
  const Eigen::MatrixXd average = averaging_of(off.size());
  const Eigen::MatrixXd slopes = average * scaled_sensitivity(fit, sensitivity, rows, scale);
  const Eigen::MatrixXd covariance =
      variance * average * correlation * average.transpose() +
      slopes * fit.covariance.theta_covariance() * slopes.transpose();
  const Eigen::VectorXd mean = average * off;
  const double contrasts = static_cast<double>(mean.size());
  const double f = mean.dot(solve_symmetric(covariance, mean).col(0)) / contrasts;
  if (!std::isfinite(f) || f < 0.0) return std::nullopt;
  UnloadingTest test;
  test.choice = r.choice;
  test.times = std::sqrt(f);
  test.off_peak = std::sqrt(squares / static_cast<double>(samples.size())) / r.peak;
  test.p_value = fisher_tail(f, contrasts, degrees);
  return test;
}

/// Sizes of the residuals of the first unloading behind the fitted part, down to the drive at which
/// that part begins.
std::vector<double> unloading_of(const RecordingFit& r) {
  std::vector<double> sizes;
  const auto first = std::ranges::find(r.fitted, true);
  const auto last = std::find(r.fitted.rbegin(), r.fitted.rend(), true);
  if (first == r.fitted.end()) return sizes;
  const auto begin = static_cast<std::size_t>(first - r.fitted.begin());
  const auto end = static_cast<std::size_t>(r.fitted.rend() - last);
  double deepest = r.drive[begin];
  for (std::size_t i = begin; i < end; ++i) deepest = std::max(deepest, r.drive[i]);
  for (std::size_t i = end; i < r.time_s.size() && r.drive[i] > r.drive[begin]; ++i) {
    if (r.drive[i] > deepest || r.is_censored(i) || !std::isfinite(r.predicted[i])) continue;
    sizes.push_back(std::abs(r.observed[i] - r.predicted[i]));
  }
  return sizes;
}

/// What the residuals of a fitted part tell of its noise.
struct LoadingNoise {
  double sd = 0.0, degrees = 0.0;  ///< 0 degrees: nothing
  double independent_share = 1.0;  ///< of the samples
};

LoadingNoise loading_noise(const FitResult& fit, const RecordingFit& r) {
  const auto n = static_cast<double>(std::ranges::count(r.fitted, true));
  const double parameters = parameters_each(fit);
  const double independent = independent_samples(r);
  if (!(independent > parameters + 1.0) || !(r.rms_residual > 0.0)) return {};
  return {r.rms_residual * std::sqrt(n / (n - parameters)), independent - parameters,
          independent / n};
}

/// Where the first unloading behind the fitted part ends; the end of that part without one.
double end_of_unloading_s(const RecordingFit& r, double to_s) {
  constexpr double kLeastShare = 0.2;  // of the peak
  constexpr double kRise = 0.02;       // of the range of the drive
  const auto first = std::ranges::find(r.fitted, true);
  if (first == r.fitted.end()) return to_s;
  const auto begin = static_cast<std::size_t>(first - r.fitted.begin());
  double deepest = r.drive[begin], peak = 0.0, end_s = to_s;
  std::size_t i = begin;
  for (; i < r.time_s.size() && r.time_s[i] <= to_s; ++i) {
    deepest = std::max(deepest, r.drive[i]);
    const double rise = r.observed[i] - r.observed[begin];
    if (r.fitted[i] && std::abs(rise) > std::abs(peak)) peak = rise;
  }
  double shallowest = deepest;
  for (; i < r.time_s.size() && r.drive[i] > r.drive[begin]; ++i) {
    if (r.drive[i] > shallowest + kRise * (deepest - r.drive[begin])) break;
    shallowest = std::min(shallowest, r.drive[i]);
    if (!((r.observed[i] - r.observed[begin]) / peak > kLeastShare)) break;
    end_s = r.time_s[i];
  }
  return end_s;
}

}  // namespace

bool has_memory(const LawSpec& law) {
  return law.branches > 0 || law.fractional != Fractional::none;
}

std::string UnloadingOff::words() const {
  if (!(times > 0.0)) return {};
  return fmt::format("the unloading is off by {} times the residual of the loading",
                     times_text(times));
}

UnloadingOff unloading_off(const FitResult& fit, const FitResult& closest) {
  constexpr double kOfMedian = 1.4826, kEfficiency = 0.37;  // of a normal distribution's median
  UnloadingOff off;
  for (std::size_t i = 0; i < fit.recordings.size(); ++i) {
    const RecordingFit& r = fit.recordings[i];
    if (fit.config.data[r.choice].load_imposed) continue;
    const std::vector<double> unloading = unloading_of(r);
    if (unloading.size() < kFewestUnloading) continue;
    LoadingNoise noise = loading_noise(closest, closest.recordings[i]);
    if (!(noise.degrees > 0.0)) noise = loading_noise(fit, r);
    if (!(noise.degrees > 0.0)) continue;
    off.samples += unloading.size();
    const double times = kOfMedian * median(unloading) / noise.sd;  // single ones may lie far off
    const double degrees =
        kEfficiency * static_cast<double>(unloading.size()) * noise.independent_share;
    if (!(fisher_tail(times * times, degrees, noise.degrees) < kAdequacyLevel)) continue;
    off.times = std::max(off.times, times);
  }
  return off;
}

std::string both_off(const FitResult& fit, const FitResult& closest,
                     std::span<const PreparedRecording> recordings, SetupOptions setup) {
  const std::string off = unloading_off(fit, closest).words();
  if (off.empty()) return {};
  std::vector<PreparedRecording> longer(recordings.begin(), recordings.end());
  for (const RecordingFit& r : fit.recordings) {
    longer[r.choice].to_s = end_of_unloading_s(r, longer[r.choice].to_s);
  }
  setup.profiles = false;
  setup.placements = nullptr;
  FitResult both;
  const std::string failure = gave_up([&] {
    both = run_fit(recording_config(fit.config.law.value(), longer, setup), data_sets(longer));
  });
  if (!failure.empty()) return off;
  double worst = 0.0;
  for (std::size_t i = 0; i < both.recordings.size(); ++i) {
    const LoadingNoise noise = loading_noise(closest, closest.recordings[i]);
    const LoadingNoise left = loading_noise(both, both.recordings[i]);
    if (!(noise.degrees > 0.0)) continue;
    const double times = both.recordings[i].rms_residual / noise.sd;
    // Residuals that repeat each other and leave no degree of freedom are no noise.
    const double degrees = std::max(left.degrees, 1.0);
    if (fisher_tail(times * times, degrees, noise.degrees) < kAdequacyLevel)
      worst = std::max(worst, times);
  }
  if (!(worst > 0.0)) return {};
  return fmt::format("{}; fitted to both, the residual is {} times that", off, times_text(worst));
}

std::string hysteresis_of(const FitResult& fit) {
  if (!fit.config.law || has_memory(*fit.config.law)) return {};
  return unloading_off(fit, fit).words();
}

std::vector<UnloadingTest> test_unloading(const FitResult& fit, const std::vector<DataSet>& data) {
  std::vector<UnloadingTest> tests;
  if (!is_testable(fit)) return tests;
  const ExperimentResiduals function(fit.config, data);
  RowMatrix sensitivity;
  static_cast<void>(function.predict(fit.best.natural, &sensitivity));
  std::size_t place = 0;
  for (const Experiment& experiment : function.experiments()) {
    if (!experiment.is_recording) continue;
    const RecordingFit& r = fit.recordings[place++];
    if (fit.config.data[r.choice].load_imposed || is_step_response(r.response_quantity)) continue;
    if (auto test = test_of(fit, function, experiment, r, sensitivity)) tests.push_back(*test);
  }
  return tests;
}

}  // namespace tpm::fit
