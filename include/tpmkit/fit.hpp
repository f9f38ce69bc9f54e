#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::fit {

/// Verdict of the data on one parameter.
enum class Verdict {
  identified,   ///< the interval is closed on both sides
  lower_only,   ///< only a lower limit: larger values up to the bound cannot be told apart
  upper_only,   ///< only an upper limit
  flat,         ///< no limit within the bounds
  failed,       ///< the profile reached neither a limit nor a bound
  not_profiled  ///< profiles were switched off
};

[[nodiscard]] std::string_view verdict_name(Verdict verdict) noexcept;

/// Estimate of a parameter by a fit with a drift of the zero; SI.
struct WithDrift {
  double estimate = 0.0;
  std::optional<double> lower, upper;
};

/// One estimated parameter, SI.
struct FittedParameter {
  std::string name;
  std::string unit;  ///< SI symbol
  double estimate = 0.0;
  std::optional<double> standard_error;  ///< linearised
  std::optional<double> lower, upper;    ///< confidence limits by profile likelihood
  Verdict verdict = Verdict::not_profiled;
  bool nuisance = false;  ///< belongs to the recording or its noise, not to the material
  /// The law does not describe the data: estimate, limits and verdict hold only if it did.
  bool only_if_described = false;
  /// Effects that the recording cannot separate from it ("drift or a slow branch"): it is then not
  /// identified, whatever the verdict.
  std::optional<Remark> not_separable = std::nullopt;
  /// The second answer, where no rest tells a drift of the zero: `lower` and `upper` hold its
  /// interval, too.
  std::optional<WithDrift> with_drift = std::nullopt;
  /// Why the minimum itself is not trusted ("found by one start of 5", "contact is undetermined");
  /// the parameter is then not identified, whatever the verdict.
  std::optional<Remark> unconfirmed = std::nullopt;
  std::string summary;  ///< the verdict as a sentence
};

/// The law of the lowest BIC, where the data prefer it by more than 10 in BIC to the simplest law
/// whose parameters they identify: neither answers alone.
struct PreferredLaw {
  std::string law;            ///< as law_name() writes it
  double ahead_in_bic = 0.0;  ///< of the law that the result holds
  std::string reason;         ///< what is not identified of it
  std::vector<FittedParameter> parameters;
};

/// Result of a fit.
struct FitSummary {
  std::optional<LawFile> law;  ///< the fitted law with its uncertainty; none: no law was fitted
  double chi_square = 0.0;     ///< sum of squared standardised residuals
  int degrees_of_freedom = 0;  ///< values less estimated parameters
  int starts_run = 0, starts_failed = 0;
  int starts_agreeing = 0;  ///< that ended in the best minimum
  std::vector<FittedParameter> parameters;
  std::optional<PreferredLaw> preferred;  ///< see there; none: the result's law stands alone
  std::optional<LawAdequacy> adequacy;    ///< whether the law describes the data, if it was tested
  std::vector<Remark> remarks;            ///< warnings and assumptions
  std::string text;                       ///< for a terminal
  std::string json;                       ///< everything, keys in docs/fit_files.md
};

/// Options of a fit.
struct FitRequest {
  /// For fit_recordings(): the law, as law_name() writes it ("linear-2"). Empty: the simplest law
  /// of the family that the data support.
  std::string law;
  std::optional<std::size_t> starts;  ///< of the search; default: the configuration's, or 40
  std::optional<std::uint64_t> seed;  ///< of the starts; default: the configuration's, or 0
  /// For fit_recordings(), as the options of `tpm fit` of these names, SI. Contact and zero are
  /// held; contact lies where the force passes `contact_force_N`, in place of `contact`.
  std::optional<double> contact = std::nullopt, contact_force_N = std::nullopt, zero = std::nullopt;
  /// Samples before and after these times of the files are left out.
  std::optional<double> from_s = std::nullopt, until_s = std::nullopt;
  /// Called before each evaluation; true ends the fit with an exception.
  std::function<bool()> interrupted;
};

/// Runs the fit that a configuration states (schemas/fit.schema.json, docs/fit_files.md). The
/// result is the same on every run. Throws Error(bad_input) with the file and the key,
/// Error(numerical) if no start ends in a usable point.
[[nodiscard]] FitSummary fit_configuration(const std::filesystem::path& file,
                                           const FitRequest& request = {});

/// Fits a law to recordings together. Columns and units are read from the head of each CSV file, or
/// from a description beside it (docs/data_formats.md). Throws as fit_configuration() does.
[[nodiscard]] FitSummary fit_recordings(const std::vector<std::filesystem::path>& files,
                                        const FitRequest& request = {});

}  // namespace tpm::fit
