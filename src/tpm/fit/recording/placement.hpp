#pragma once
#include <map>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// A value with its standard uncertainty, SI.
struct Measured {
  double value = 0.0;
  double sd = 0.0;
};

/// Readings in which tissue cannot act: at rest before contact, and after the probe
/// was withdrawn.
struct RestReadings {
  std::size_t before = 0, after = 0;  ///< samples
  double noise_sd = 0.0;              ///< of one reading, SI
  double phi = 0.0;                   ///< correlation of neighbouring readings
  double origin_s = 0.0;              ///< where zero and drift are uncorrelated
  std::optional<Measured> zero;       ///< of the response, at origin_s; none without samples before
                                      ///< contact
  std::optional<Measured> drift;      ///< of the zero, per second; none below 8 samples
  double telling_drift_sd = 0.0;      ///< of the drift, by which drift_finding decides
  bool pulled = false;                ///< after withdrawal (is_pulled_after): `after` is 0
};

/// Zero and drift from the rests of an indentation, by generalised least squares of a straight line
/// (below 8 samples: of a level) with noise that is an autoregression of first order
/// (estimate_autoregression). At origin_s the zero is that of a level, with the standard deviation
///
///     sigma sqrt((1 + 2 sum_k (1 - k/n) phi^k) / n).
///
/// The noise of a rest below 100 samples is estimated together with that of the longest hold, if
/// that has more: about a line, and about a line and four exponentials.
/// Both are multiplied by sqrt(f / (f - 2)), f the degrees of freedom of their variance: the
/// standard deviation of Student's t. Where the correlation is significant their intervals count
/// every phi that the readings leave possible instead (fit_rest_line). A rest of more than 1,000
/// samples is averaged in blocks.
[[nodiscard]] RestReadings read_rests(const PreparedRecording& recording);

/// The level of the readings while the strain, or the stress that is imposed, rests at 0 before it
/// first moves: the offset of the response, or the zero of the strain. None for an indentation,
/// whose probe may not touch, for a length, whose specimen may be slack, for fewer than four such
/// samples, and where the fit begins among them.
struct LevelBeforeLoad {
  Measured level;
  std::size_t samples = 0;
};
[[nodiscard]] std::optional<LevelBeforeLoad> level_before_load(const PreparedRecording& recording);

/// RestReadings::before alone, which costs little.
[[nodiscard]] std::size_t samples_before_contact(const PreparedRecording& recording);

/// Where a probe met the tissue, extrapolated from the first part of the ramp.
struct Onset {
  Measured drive;           ///< SI
  double part = 0.0;        ///< of the ramp's travel beyond contact that it was extrapolated from
  std::size_t samples = 0;  ///< in contact, within that part; 0: it was not extrapolated
  bool from_rest = true;    ///< false: there are no samples before contact, and the rest is stated
};

/// Contact as the onset of first loading F = zero + A x^m (1 + B x), x = drive - contact >= 0, by
/// least squares over the first 5 to 50 % of the travel, whichever part is expected to leave the
/// least uncertainty: of the noise (for the loading that the largest part shows), the zero, and a
/// quarter of what B moves (how far the loading departs from a power within the part).
///
/// Where fewer than 8 samples lie within any part, contact is between two samples, and before the
/// force that is seen by as far as a power stays below five standard deviations of the noise.
///
/// Without samples before contact, a preload is extrapolated back to no force, and the uncertainty
/// is as large as the way there.
/// @param exponent m of the law; none: anything from 1 to 3 that fits
[[nodiscard]] Onset find_onset(const PreparedRecording& recording, const RestReadings& rests,
                               std::optional<double> exponent);

/// The exponent of a law's first loading; none if the law estimates it.
[[nodiscard]] std::optional<double> first_loading_exponent(const LawSpec& law,
                                                           std::optional<double> of_probe);

/// Verdict whether a drift of the zero can be told from a slow relaxation of the tissue.
enum class DriftFinding {
  no_hold,        ///< nothing is held: no drift is asked for
  told,           ///< the rests tell a slope: it is in the fit
  not_separable,  ///< its uncertainty over loading and hold exceeds 2 % of the relaxed force, or
                  ///< there is no rest
};

/// Where the hold has the noise of the rests, the uncertainty at the most likely phi decides, and
/// not the stated one, which counts every phi that the readings leave possible: that one is larger,
/// the less is known of phi, and recordings whose correlation seems small by chance would be told
/// and the others not.
/// @return told only if that uncertainty of the slope times the time from contact to the end of
///         the longest hold is at most 2 % of the force there
[[nodiscard]] DriftFinding drift_finding(const PreparedRecording& recording,
                                         const RestReadings& rests);

/// Measured placement of one recording, for a law.
struct MeasuredPlacement {
  RestReadings rests;
  Onset onset;
  DriftFinding drift = DriftFinding::no_hold;
};

/// The finding about a drift depends on the estimated noise. Rests whose noise seems small by
/// chance tell it more often. Where the standard deviation at the upper end of the 95 % interval of
/// the noise would not tell it, zero and drift have that one; but for correlated noise that is that
/// of the hold, too, which makes most of them told (drift_finding).
[[nodiscard]] MeasuredPlacement measure_placement(const PreparedRecording& recording,
                                                  const LawSpec& law,
                                                  std::optional<double> exponent);

/// Measured placements of recordings, for a choice among laws: many of them have one exponent, and
/// the placement depends on nothing else of a law. Not for several threads.
class PlacementMemory {
 public:
  /// As measure_placement(). Recordings are known by name and window; the rest of one of a name
  /// must not change as long as this lives.
  [[nodiscard]] const MeasuredPlacement& of(const PreparedRecording& recording, const LawSpec& law,
                                            std::optional<double> of_probe);

 private:
  using Key = std::tuple<std::string, double, double, std::optional<double>>;
  std::map<Key, MeasuredPlacement> measured_;
};

}  // namespace tpm::fit
