#pragma once
// Simulated indentations, healthy or with a defect, fitted as tpm fit does: how often a law that is
// right is called wrong, and how often a defect is found and named.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpmkit/law.hpp"

namespace tpm::test {

enum class Defect { none, slow_branch, drift, slip, ringing, transient, lost };

inline const char* defect_name(Defect defect) {
  switch (defect) {
    case Defect::none:
      return "none";
    case Defect::slow_branch:
      return "a branch of 12 s that is not fitted";
    case Defect::drift:
      return "a drift of the zero";
    case Defect::slip:
      return "a jump of the zero at 10 s";
    case Defect::ringing:
      return "ringing after the ramp";
    case Defect::transient:
      return "a start-up of 0.3 s";
    case Defect::lost:
      return "a lost signal of 1 s";
  }
  return "";
}

/// One recording: 60 N/m beside 45 N/m that relax in 2 s, a ramp of 2 mm/s to 4 mm, a hold to 24 s,
/// a sample every 0.1 s, noise of 0.4 mN.
struct AdequacyTrial {
  int at_rest = 20;      ///< samples before the ramp
  double rho = 0.0;      ///< lag-1 correlation of the noise
  double quantum = 0.0;  ///< step of the readings, in standard deviations of the noise
  Defect defect = Defect::none;
  double defect_N = 0.0;  ///< its amplitude
  double clip = 0.0;      ///< readings end at this part of the peak; 0: they do not
  bool noisy = true;
  std::uint64_t seed = 1;
};

inline constexpr double kNoise_N = 4e-4, kStep_s = 0.1, kRamp_s = 2.0, kEnd_s = 24.0;

inline double defect_force(Defect defect, double t) {
  switch (defect) {
    case Defect::none:
      return 0.0;
    case Defect::slow_branch: {
      const double ramp = std::clamp(t, 0.0, kRamp_s);
      return t < 0.0 ? 0.0 : 6.0 * (1.0 - std::exp(-ramp / 12.0)) * std::exp(-(t - ramp) / 12.0);
    }
    case Defect::drift:
      return t / kEnd_s;
    case Defect::slip:
      return t < 10.0 ? 0.0 : 1.0;
    case Defect::ringing:
      return t < kRamp_s ? 0.0 : std::exp((kRamp_s - t) / 3.0) * std::sin(9.0 * t);
    case Defect::transient:
      return t < 0.0 || t > 0.3 ? 0.0 : 1.0;
    case Defect::lost:
      return 0.0;
  }
  return 0.0;
}

inline Recording simulated(const AdequacyTrial& trial) {
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  base::Random random(trial.seed);
  double noise = random.normal();
  const int samples = trial.at_rest + static_cast<int>(std::lround(kEnd_s / kStep_s));
  for (int i = 0; i < samples; ++i) {
    const double t = kStep_s * (i - trial.at_rest);
    const double ramp = std::clamp(t, 0.0, kRamp_s);
    const double since = std::max(t, 0.0);
    // 2 mm/s times k_inf t, and k1 tau1 (1 - exp(-t/tau1)), decaying in the hold.
    double force = 2e-3 * (60.0 * ramp + 45.0 * 2.0 * (1.0 - std::exp(-ramp / 2.0)) *
                                             std::exp(-(since - ramp) / 2.0));
    force += trial.defect_N * defect_force(trial.defect, t);
    if (trial.defect == Defect::lost && t > 10.0 && t <= 11.0 && trial.defect_N > 0.0) force = 0.0;
    if (trial.noisy) force += kNoise_N * noise;
    noise = trial.rho * noise + std::sqrt(1.0 - trial.rho * trial.rho) * random.normal();
    r.time_s.push_back(t + kStep_s * trial.at_rest);
    r.drive.push_back(2e-3 * ramp);
    r.response.push_back(force);
  }
  if (trial.clip > 0.0) {
    const double limit = trial.clip * *std::ranges::max_element(r.response);
    for (double& force : r.response) force = std::min(force, limit);
  }
  if (trial.quantum > 0.0) {
    const double step = trial.quantum * kNoise_N;
    for (double& force : r.response) force = step * std::round(force / step);
  }
  return r;
}

struct AdequacyOutcome {
  LawAdequacy adequacy;
  bool clipped = false;
  double rms_N = 0.0;
  bool drift_fitted = false;
  int intervals = 0;  ///< of k_inf, k1 and tau1, without a condition
  int missing = 0;    ///< of these, that do not hold the true value
};

/// @param profiles intervals by profile likelihood, closed ones only; else from the covariance
inline AdequacyOutcome fitted(const AdequacyTrial& trial, bool profiles = false) {
  const fit::PreparedRecording one = fit::prepare_recording("simulated", simulated(trial));
  fit::SetupOptions setup;
  setup.starts = 4;
  setup.profiles = profiles;
  const std::span<const fit::PreparedRecording> span(&one, 1);
  fit::FitResult result = fit::run_fit(
      fit::recording_config(parse_law_name("linear-1", "law"), span, setup), fit::data_sets(span));
  fit::give_both_drift_answers(result, span);
  fit::state_adequacy(result, span);
  AdequacyOutcome outcome;
  outcome.adequacy = result.adequacy.value();
  outcome.clipped = one.clipped_above.has_value();
  outcome.rms_N = result.recordings.front().rms_residual;
  outcome.drift_fitted = std::ranges::any_of(result.config.parameters,
                                             [](const auto& p) { return p.drift.has_value(); });
  const double spread = base::student_quantile(0.975, result.degrees_of_freedom);
  for (const fit::ParameterResult& p : result.parameters) {
    const double truth = p.parameter.name == "k_inf"  ? 60.0
                         : p.parameter.name == "k1"   ? 45.0
                         : p.parameter.name == "tau1" ? 2.0
                                                      : 0.0;
    const bool told = !p.only_if_described && !p.not_separable;
    if (truth == 0.0 || !p.standard_error || !told) continue;
    if (profiles && p.verdict != fit::Verdict::identified) continue;
    const double lower = profiles ? *p.lower : p.estimate - spread * *p.standard_error;
    const double upper = profiles ? *p.upper : p.estimate + spread * *p.standard_error;
    ++outcome.intervals;
    outcome.missing += truth < lower || truth > upper;
  }
  return outcome;
}

/// Residual (rms) of the best fit to a recording without noise. Zero, contact and drift are what
/// that recording tells: those of a noisy one would leave something of their own.
inline double left_without_noise(AdequacyTrial trial) {
  trial.noisy = false;
  trial.quantum = 0.0;
  const fit::PreparedRecording one = fit::prepare_recording("simulated", simulated(trial));
  fit::SetupOptions setup;
  setup.starts = 4;
  setup.profiles = false;
  setup.measured = false;
  const std::span<const fit::PreparedRecording> span(&one, 1);
  const fit::FitResult fit = fit::run_fit(
      fit::recording_config(parse_law_name("linear-1", "law"), span, setup), fit::data_sets(span));
  // Without noise a defect of a few samples stands out and is left out of the fit: it counts here.
  const fit::RecordingFit& r = fit.recordings.front();
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < r.observed.size(); ++i) {
    if (!r.fitted[i] && !(i < r.outlier.size() && r.outlier[i])) continue;
    squares += std::pow(r.observed[i] - r.predicted[i], 2);
    ++count;
  }
  return std::sqrt(squares / count);
}

/// The amplitude at which it leaves so many noises.
inline double amplitude_for(AdequacyTrial trial, double noises) {
  trial.rho = trial.quantum = 0.0;
  trial.defect_N = noises * kNoise_N;
  for (int i = 0; i < 6; ++i) trial.defect_N *= noises * kNoise_N / left_without_noise(trial);
  return trial.defect_N;
}

}  // namespace tpm::test
