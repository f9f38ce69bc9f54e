#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/likelihood.hpp"
#include "tpm/fit/likelihood/bootstrap.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/likelihood/correlation.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/fit/uncertainty.hpp"
#include "tpm/fit/waterfall.hpp"
#include "tpmkit/fit.hpp"
#include "tpmkit/law_uncertainty.hpp"

namespace tpm::fit {

/// Symmetric limits, SI.
struct Limits {
  double lower = 0.0, upper = 0.0;
};

/// A nuisance parameter that stands on one of its bounds: what depends on it holds only there.
struct Condition {
  std::string parameter;
  bool upper = false;       ///< else the lower bound
  double value = 0.0;       ///< of the bound, SI
  bool at_estimate = true;  ///< false: only where the interval of the dependent parameter ends

  bool operator==(const Condition&) const = default;
};

/// Result for one estimated parameter; SI.
struct ParameterResult {
  FitParameter parameter;
  bool nuisance = false;  ///< belongs to the recording or its noise, not to the material
  /// The automatic bounds, where the best fit or an interval pressed on them and they were widened.
  std::optional<Limits> first_bounds;
  std::vector<Condition> conditional_on;
  /// Effects that the recording cannot separate from it ("drift or a slow branch"); it is then not
  /// identified, whatever its profile says. See EstimatedParameter.
  std::optional<Remark> not_separable;
  /// Of a fit with a drift of the zero, where no rest tells one: `lower` and `upper` then hold this
  /// interval, too.
  std::optional<WithDrift> with_drift = std::nullopt;
  double estimate = 0.0;
  std::optional<double> standard_error;  ///< linearised, in natural units
  std::optional<double> lower, upper;    ///< confidence limits by profile likelihood
  bool at_lower_bound = false, at_upper_bound = false;
  Verdict verdict = Verdict::not_profiled;
  /// The law does not describe the data: estimate, interval and verdict hold only if it did.
  bool only_if_described = false;
  /// Why the minimum itself is not trusted ("found by one start of 5", "contact is undetermined");
  /// it is then not identified, whatever its profile says.
  std::optional<Remark> unconfirmed;
  std::string summary;  ///< one sentence
  Profile profile;
};

/// A minimum that at least one start ended in.
struct DistinctMinimum {
  Minimum minimum;
  int starts = 0;                 ///< how many ended here (deviance equal to 1e-5)
  std::vector<double> low, high;  ///< smallest and largest of each parameter among them, SI
};

struct HypothesisResult {
  Hypothesis hypothesis;
  Minimum minimum;    ///< the other parameters re-optimised
  double rise = 0.0;  ///< of the deviance above the best fit
  double p_value = 1.0;
  bool excluded = false;  ///< p < 1 - level
  std::string summary;
};

/// One reading with the fitted model's answer.
struct FittedDatum {
  FitDatum datum;
  double predicted = 0.0;              ///< SI
  std::optional<double> predicted_sd;  ///< from the parameters' covariance
  double reading_sd = 0.0;    ///< of the reading itself, on its own scale whatever the noise's, SI
  double standardised = 0.0;  ///< (predicted - value) / sigma after the noise model
  std::optional<Limits> confidence;  ///< pointwise band of the curve, at the fit's level
  std::optional<Limits> prediction;  ///< where one new reading falls
  std::optional<double> imposed_depth_m = std::nullopt;  ///< largest of the history it belongs to
};

/// One recording with the fitted model's answer.
struct RecordingFit {
  std::size_t choice = 0;  ///< place in FitConfig::data
  Quantity drive_quantity = Quantity::indentation_depth;
  Quantity response_quantity = Quantity::contact_force;
  Provenance provenance = Provenance::measured;
  std::vector<double> time_s, drive, observed, predicted;  ///< SI; see Response for NaN
  /// Drive of the law at a sample: what was imposed, or what answers an imposed load.
  [[nodiscard]] double law_drive(std::size_t i) const {
    const bool load =
        drive_quantity == Quantity::stress || drive_quantity == Quantity::contact_force;
    return load ? predicted[i] : drive[i];
  }
  std::vector<double> standardised;   ///< residuals in standard deviations
  std::vector<bool> fitted;           ///< false: outside the window, or censored
  std::vector<bool> censored;         ///< at a limit of the force cell, within the window
  std::vector<bool> outlier;          ///< left out of the fit, see isolated_outliers
  double peak = 0.0;                  ///< largest |observed| in the window
  double rms_residual = 0.0;          ///< in the window, SI
  std::optional<double> rms_outside;  ///< of the predicted samples outside, if there are any
  std::size_t not_predicted = 0;      ///< samples outside whose `predicted` is NaN
  /// Prediction band, where one new sample falls, SI; empty if the covariance is not of full rank.
  std::vector<double> lower, upper;
  [[nodiscard]] bool is_censored(std::size_t i) const { return i < censored.size() && censored[i]; }
  std::optional<double> share_inside;      ///< of the fitted samples, within that band
  std::optional<Correlation> correlation;  ///< of the fitted samples' residuals
};

struct FitResult {
  FitConfig config;
  Minimum best;
  int value_count = 0, band_count = 0;
  double chi_square = 0.0;             ///< sum of squared standardised residuals, bands included
  int degrees_of_freedom = 0;          ///< values less estimated parameters
  std::optional<double> chi_square_p;  ///< only for a known noise scale and dof > 0
  double variance_factor = 1.0;
  double least_variance = 0.0;             ///< Threshold::least_variance
  std::optional<Likelihood> likelihood;    ///< none where there is none, see likelihood_at
  std::optional<Correlation> correlation;  ///< over all recordings, if there are any
  double inflation = 1.0;                  ///< Threshold::inflation of the intervals
  std::optional<NoiseOfEstimates> noise;   ///< Threshold::noise of the intervals
  std::vector<ParameterResult> parameters;
  Covariance covariance;
  std::string weakest_words;
  int starts_run = 0, starts_failed = 0, starts_agreeing = 0;
  Waterfall waterfall;
  std::vector<DistinctMinimum> minima;  ///< rising deviance
  std::vector<HypothesisResult> hypotheses;
  std::optional<BootstrapResult> bootstrap;
  std::vector<FittedDatum> data;  ///< separate readings
  std::vector<RecordingFit> recordings;
  std::vector<std::string> data_sha256;  ///< of the files, one for each of config.data
  std::optional<LawAdequacy> adequacy;   ///< whether the law describes the data, if it was tested
  std::vector<Remark> remarks;           ///< what a reader must know
};

/// Minimum over many starts, intervals, verdicts, hypotheses. Deterministic for a given config.
/// Throws Error(bad_input) for data that do not fit the configuration, Error(numerical) if no
/// start ends in a usable point.
[[nodiscard]] FitResult run_fit(const FitConfig& config);

/// The same with data in memory, one for each of config.data.
[[nodiscard]] FitResult run_fit(const FitConfig& config, const std::vector<DataSet>& data);

[[nodiscard]] FitResult fit_experiments(const ExperimentResiduals& function);

/// That of the intervals of a fit.
[[nodiscard]] Threshold threshold_of(const FitResult& fit);

/// Sets Threshold::inflation and Threshold::noise by the residuals at a minimum (SI values).
using NoiseRule = std::function<void(std::span<const double>, Threshold&)>;

/// The same for any residuals: the part of run_fit that does not know what is fitted. Fills best,
/// parameters, covariance, starts and minima.
/// @param noise asked at the minimum, and again where a profile met a deeper one
/// @param led_there of each start that is a minimum found before: how many starts had led there,
///                  which DistinctMinimum::starts counts; empty for 1 each
[[nodiscard]] FitResult fit_residuals(const ResidualFunction& function,
                                      std::vector<FitParameter> parameters,
                                      const std::vector<std::vector<double>>& starts,
                                      Threshold threshold, bool profiles,
                                      StartKind kind = StartKind::anywhere,
                                      const NoiseRule& noise = {},
                                      std::span<const int> led_there = {});

/// Limits of the free parameters from the covariance alone, open at the bounds; none without one of
/// full rank.
void linear_intervals(FitResult& result, std::span<const FitParameter> parameters,
                      const Threshold& threshold);

/// Machine-readable result, keys in docs/fit_files.md, numbers rounded to 6 significant digits so
/// that they agree between machines.
[[nodiscard]] Json to_json(const FitResult& result);

/// Plain text for a terminal.
[[nodiscard]] std::string to_terminal_text(const FitResult& result);

/// "12.3 kPa": a value in the parameter's own unit, 4 significant digits.
[[nodiscard]] std::string in_unit(const FitParameter& parameter, double natural);

}  // namespace tpm::fit
