#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/groups/random_effects.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// One recording's own fit of the common law.
struct SpecimenRow {
  std::string name;
  std::string specimen = {};     ///< whose repeat it is; empty: a specimen of its own
  std::optional<FitResult> fit;  ///< empty if it could not be fitted
  std::string reason;            ///< then why
  /// Index of the fit's parameter that stands for each of the common law's: a fit may number its
  /// branches in any order, here they are sorted by their relaxation times.
  std::vector<std::size_t> place;

  /// The result for the common law's parameter i of a recording that was fitted.
  [[nodiscard]] const ParameterResult& parameter(std::size_t i) const {
    return fit.value().parameters[place[i]];
  }
};

/// One material parameter over the specimens.
struct PooledParameter {
  FitParameter parameter;
  RandomEffects effects;  ///< in theta
  int left_out = 0;       ///< recordings that do not determine it: it is at a bound, depends on a
                          ///< nuisance parameter at one, its minimum is not trusted, or the fit is
                          ///< of no full rank
  int not_separable = 0;  ///< recordings that do not tell it from something else; left out, too,
                          ///< unless all are such
  /// All of them are such, and this is what they do not tell it from ("drift or a slow branch"):
  /// what is pooled is not identified, and holds only without that.
  std::optional<Remark> only_without = std::nullopt;
  /// Recordings among those pooled that the law does not describe: what is pooled is not identified
  /// without the condition that it did.
  int not_described = 0;

  [[nodiscard]] bool identified() const { return !only_without && not_described == 0; }
};

struct SpecimenStudy {
  LawSpec law;      ///< with the reference depth of all coefficients
  std::string why;  ///< how the law was chosen
  std::vector<SpecimenRow> rows;
  std::vector<PooledParameter> pooled;
  double level = 0.95;  ///< of all intervals
};

/// Fits one law to each recording by itself and pools the material parameters with random effects:
/// a typical specimen, its interval, and the spread between specimens. All coefficients refer to
/// one depth: options.setup.reference, or common_reference(). Recordings of one specimen
/// (PreparedRecording::specimen) are its repeats.
/// @param law empty: of the laws whose parameters are identified in most of the recordings, the one
///        with the fewest parameters whose sum of BIC over the recordings is within the margin (for
///        each recording) of the least sum; if there is no such law, of all laws
[[nodiscard]] SpecimenStudy study_specimens(std::span<const PreparedRecording> recordings,
                                            const std::optional<LawSpec>& law,
                                            SelectionOptions options);

/// Pools what fits of one law found. Throws Error(bad_input) naming a recording whose coefficients
/// refer to another depth than the first one's.
[[nodiscard]] std::vector<PooledParameter> pool_specimens(const std::vector<SpecimenRow>& rows,
                                                          double level);

/// Estimates of the common law's parameter i by the recordings, in theta of `parameter`. A
/// recording that does not determine it (PooledParameter::left_out) is counted, not listed.
struct ParameterEstimates {
  FitParameter parameter;  ///< of log scale unless it may be negative
  std::vector<SpecimenEstimate> estimates;
  int left_out = 0;
  int not_separable = 0;               ///< as PooledParameter
  std::optional<Remark> only_without;  ///< as PooledParameter
  std::optional<Remark> doubt;         ///< what `not_separable` recordings do not tell it from
  int not_described = 0;               ///< as PooledParameter
};
/// @param like a row that was fitted: what parameter i is
[[nodiscard]] ParameterEstimates parameter_estimates(std::span<const SpecimenRow> rows,
                                                     const SpecimenRow& like, std::size_t i);

/// Why what is pooled (or compared) is not identified, in words; empty if it is.
[[nodiscard]] std::string pooled_doubt(const std::optional<Remark>& only_without,
                                       int not_described);

/// True if the law does not describe the data of a fit.
[[nodiscard]] bool is_not_described(const FitResult& fit);

/// True if a fit's parameter belongs to the recording (contact, offset), not to the specimen.
[[nodiscard]] bool is_of_recording(const ParameterResult& p);

/// Two files with the same readings (samples_sha256) are one measurement, however they are named
/// and written. Throws Error(bad_input) naming both.
void require_distinct_readings(std::span<const PreparedRecording> recordings);

[[nodiscard]] Json to_json(const SpecimenStudy& study);
[[nodiscard]] std::string to_terminal_text(const SpecimenStudy& study);

}  // namespace tpm::fit
