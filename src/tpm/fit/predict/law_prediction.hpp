#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {

/// Contact point and offset of what is predicted.
enum class Placement {
  surface,  ///< 0: the depth counts from the surface and the sensor has no zero error
  fitted,   ///< those of the fit, with their uncertainty: the same recording goes on
  own,      ///< found for the given recording, the material fixed: another recording
};

/// "surface", "fitted", "own".
[[nodiscard]] std::string_view placement_name(Placement placement) noexcept;
[[nodiscard]] Placement parse_placement(std::string_view text, std::string_view where);

struct PredictionOptions {
  /// None: surface for a protocol; for a recording fitted if the fit has read the same bytes, else
  /// own.
  std::optional<Placement> placement;
  /// Of a recording whose placement is its own: contact and zero that are held, SI; none: found.
  std::optional<double> contact, zero;
  std::optional<double> level;  ///< in (0, 1); none: that of the fit
  /// Bands from so many laws drawn from the fit's covariance instead of from derivatives; 0: from
  /// derivatives. At least 100.
  int samples = 0;
  std::uint64_t seed = 0;
};

/// Comparison of one part of a recording with its prediction.
struct PredictionComparison {
  int samples = 0;
  double rms = 0.0, largest = 0.0;              ///< of prediction less measurement, SI
  std::optional<double> share_in_reading_band;  ///< of these samples
};

/// A recording beside its prediction.
struct PredictedRecording {
  std::string name;
  Provenance provenance = Provenance::measured;
  std::vector<double> observed;           ///< SI
  std::vector<bool> was_fitted;           ///< the fit has read these samples
  double peak = 0.0;                      ///< largest |observed| in the window, SI
  PredictionComparison fitted, held_out;  ///< within the window of the ramp and hold
  PredictionComparison outside;           ///< unloading and after
  std::vector<bool> in_window;
};

/// A law's answer to a history with two bands, SI.
struct LawPrediction {
  LawSpec spec;
  std::size_t organ_spheres = 0;  ///< of an organ that answers in place of the law; else 0
  Drive drive_kind = Drive::displacement;
  double level = 0.95;
  double quantile = 0.0;  ///< of the standard error: normal or Student's t
  Placement placement = Placement::surface;
  double contact = 0.0, offset = 0.0;
  int samples = 0;  ///< laws drawn; 0: by derivatives
  std::vector<double> time_s, imposed;
  std::vector<double> response;        ///< NaN where the law does not predict
  std::vector<double> standard_error;  ///< of the mean
  /// Band of the mean: where the response of the tissue without noise is.
  std::vector<double> mean_lower, mean_upper;
  /// Band for one new reading, which scatters about the mean; empty if the noise is not known.
  std::vector<double> reading_lower, reading_upper;
  std::optional<PredictedRecording> recording;
  std::vector<Remark> remarks;  ///< what a reader must know

  [[nodiscard]] Dimension response_dimension() const;
  /// "linear-2-relaxing", or "linear-2-relaxing on an organ of 142 spheres".
  [[nodiscard]] std::string subject() const;
};

/// The response to a protocol with the uncertainty of the fit,
///
///     SE^2 = g' C g,   mean f +- q SE,   reading f +- q sqrt(SE^2 + sigma^2),
///
/// g the exact derivatives of the response by the coordinates of the law's uncertainty, C their
/// covariance, q the quantile of Student's t (known size of the noise: normal), sigma the scatter
/// of one reading (Seber & Wild, Nonlinear Regression, 1989, 5.1).
/// Throws Error(bad_input) for a law without uncertainty, a protocol that its drive does not know,
/// or options out of range.
[[nodiscard]] LawPrediction predict_law(const LawFile& law, const Protocol& protocol,
                                        std::span<const double> times_s,
                                        const PredictionOptions& options);

/// The same along a recording's own motion, beside its readings. The law is not fitted again; with
/// Placement::own the recording's contact point and offset are, and their own uncertainty is part
/// of the band.
[[nodiscard]] LawPrediction predict_recording(const LawFile& law,
                                              const PreparedRecording& recording,
                                              const PredictionOptions& options);

/// Adds to the remarks of a prediction where it goes beyond what the law was fitted to
/// ("extrapolates: ..."), and what is known against the law or its bands. Reads drive_kind,
/// contact, time_s, imposed and response.
void add_range_remarks(LawPrediction& prediction, const LawFile& law);

[[nodiscard]] Json to_json(const LawPrediction& prediction);
[[nodiscard]] std::string to_terminal_text(const LawPrediction& prediction);
/// Columns time_s, the drive, mean, standard error, both bands and what was observed, SI.
[[nodiscard]] std::string to_csv(const LawPrediction& prediction);

}  // namespace tpm::fit
