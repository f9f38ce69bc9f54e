#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/instrument.hpp"
#include "tpm/fit/predict/other_fillings.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/validate/joint_test.hpp"
#include "tpm/fit/validate/placement_of_recording.hpp"
#include "tpm/fit/validate/requirement.hpp"
#include "tpm/fit/validate/specimen_spread.hpp"

namespace tpm::fit {

/// One quantity of one recording. SI throughout; E, u and U in the unit of the quantity.
struct QuantityComparison {
  QuantityOfInterest quantity;
  std::string name;
  Unit unit;                               ///< in which it is shown
  double simulated = 0.0, measured = 0.0;  ///< S, D
  ErrorWithUncertainty e;
  double u_num = 0.0, u_input = 0.0, u_D = 0.0;  ///< of u_val^2 = u_num^2 + u_input^2 + u_D^2
  std::vector<UncertaintyPart> parts;            ///< what these consist of, the largest first
  std::vector<UncertaintyPart> numerical;        ///< those of u_num, the largest first
  std::optional<double> limit;                   ///< R in this unit
  ModelVerdict verdict = ModelVerdict::not_seen;
  double p_value = 1.0;   ///< before Holm
  bool rejected = false;  ///< beyond R (or 0) after Holm over the recording's quantities
  /// The part of u_val that must shrink, or the reason why there is no verdict.
  std::optional<Remark> remark;
  bool unknown = false;  ///< a part of u_val is not known: the remark says which
  /// Root of the covariance of what recordings of one calibration share (law, common instrument):
  /// one a direction; its norm is part of u_val.
  Eigen::RowVectorXd shared;
  Eigen::RowVectorXd
      of_instrument;  ///< effects of its errors, shared by recordings of one instrument
  /// Deviations of other fillings of an organ from their mean, over sqrt(n - 1): of u_num, shared
  /// by recordings of one organ.
  Eigen::RowVectorXd of_filling;
  double of_probe = 0.0;  ///< effect of the radius of the recording's own probe, of u_input
  /// Deviations of a new specimen, of the norm that it adds to u_input (SpecimenSpread); those of
  /// the law's mean over specimens are `of_mean` times them, and shared by all recordings.
  Eigen::RowVectorXd of_specimen;
  double of_mean = 0.0;
  double specimen_with_own = 0.0;  ///< with the recordings' own u: its square has specimen_degrees
  int specimen_degrees = 0;        ///< 0: no new specimen
  double of_contact = 0.0;         ///< effect of contact between two samples (contact_u_sampled)
  Eigen::RowVectorXd of_rises;     ///< effects of changes of the drive between two samples
  double u_own = 0.0;              ///< the rest of u_val, with of_specimen and of_rises
};

/// The difference of the whole curve, which gets no verdict.
struct CurveComparison {
  std::size_t samples = 0;
  double mean_square_error = 0.0, mean_square_u = 0.0;  ///< of E and of u, SI squared
  double chi_squared = 0.0;  ///< of whitened E over sigma; 0 without noise
};

/// Verdict whether the motion lies inside the range that the law was fitted to.
struct Applicability {
  double depth = 0.0, duration_s = 0.0, rate = 0.0;  ///< of the recording
  std::optional<double> fitted_depth, fitted_duration_s;
  std::optional<double> slowest, fastest;  ///< rates of the calibration, where its files were found
  std::vector<Remark> outside;             ///< empty: inside as far as known
  std::vector<std::string> unknown;
};

struct RecordingComparison {
  std::string name, sha256;
  std::string session, press;  ///< of which the name consists; empty: no press of a session
  bool calibration = false;    ///< the law was fitted to these data
  RecordingParts parts;
  ComparedPart part;
  ReadingScatter scatter;
  ValidationPlacement placement;
  std::optional<Instrument> instrument;
  bool same_instrument = false;   ///< as the calibration's
  std::string probe;              ///< what is known of the two probes; empty: nothing is stated
  bool creep = false;             ///< the load was imposed
  std::string fillings;           ///< what u_num holds of the place of an organ's spheres
  std::string pick;               ///< name of the reduced model that answered; empty: none
  std::vector<UnseenRise> rises;  ///< changes of the drive that the samples do not show
  std::vector<QuantityComparison> quantities;
  std::vector<Remark> without;  ///< quantities that were asked for and cannot be read, and why
  JointTest joint;
  CurveComparison curve;
  ModelVerdict verdict = ModelVerdict::not_seen;  ///< of all quantities
};

/// The reduced model that answers in place of an organ, as a plan picked it.
struct PickedAnswer {
  std::string name;            ///< "linear_1"
  Eigen::VectorXd value;       ///< SI, at the recording's times; NaN where it does not answer
  double claimed_limit = 0.0;  ///< of its error, SI
};
/// @param motion beyond contact, that the organ is driven by
using PickAnswer =
    std::function<PickedAnswer(const Protocol& motion, const std::vector<double>& times_s)>;

/// Change of a quantity by rendering, in parts of it, found from a session.
struct RenderingError {
  QuantityOfInterest quantity;
  double mean = 0.0;   ///< rendered over simulated, less 1
  double limit = 0.0;  ///< of a single press about the mean; of one press its own size
  int presses = 0;
};

/// Motion of one press of a session.
struct SessionMotion {
  /// From the session's start to the end of the press, every row of it; empty: the samples alone.
  std::vector<Knot> knots;
  /// When the hand was asked to hold, of the recording's clock; none: it was not.
  std::optional<double> hold_asked_s;
  std::string session = {}, press = {};  ///< names of the file and of the phase
};

struct ComparisonOptions {
  std::vector<QuantityOfInterest> quantities;  ///< empty: default_quantities()
  std::optional<Requirement> requirement;
  PlacementRule placement = PlacementRule::held;
  KnownPlacement known = KnownPlacement::nothing;
  const OrganOfLaw* organ = nullptr;        ///< answers in place of the law
  const OtherFillings* fillings = nullptr;  ///< of the organ's body; none: not asked for
  PickAnswer pick = nullptr;                ///< answers in place of the organ
  SessionMotion motion;                     ///< of a session's press
  std::vector<RenderingError> rendering;
  std::optional<Instrument> instrument, calibration_instrument;
  bool calibration_data = false;
  /// The recording is of a new specimen: how those of the calibration differ. None: not asked for.
  const std::vector<SpecimenSpread>* specimens = nullptr;
};

/// A comparison of which nothing is computed: names, and rises that the samples do not show.
[[nodiscard]] RecordingComparison begun_comparison(const PreparedRecording& recording,
                                                   const ComparisonOptions& options);

/// Compares a law with one recording (docs/validate.md):
///
///     E = Q(S) - Q(readings less zero),   u_val^2 = u_num^2 + u_input^2 + u_D^2,   U = k u_val,
///
/// Q the same functional at the same samples. u_input^2 = g' C g with the law's covariance, and
/// what the radii of two probes and a new specimen add; u_D from the scatter of the readings,
/// through zero and contact as well, and from the instrument.
[[nodiscard]] RecordingComparison compare_with_recording(const LawFile& law,
                                                         const PreparedRecording& recording,
                                                         const ComparisonOptions& options);

/// True if a quantity is a response: peak, end of the hold, at a time or a depth.
[[nodiscard]] bool is_of_response(QuantityKind kind);

/// The unit in which a quantity is shown.
[[nodiscard]] Unit quantity_unit(const QuantityOfInterest& quantity, Quantity drive,
                                 Quantity response);

/// A unit with the prefix under which a number of that size has one to three digits before the
/// point.
[[nodiscard]] Unit scaled_unit(const Unit& unit, double size);

/// R in the unit of a quantity; none if the requirement is an amount of another dimension, or one
/// of forces (jnd) and the quantity is none.
[[nodiscard]] std::optional<double> limit_of(const Requirement& requirement,
                                             const QuantityComparison& quantity, Dimension response,
                                             double peak);

/// Makes every quantity of a recording unknown whose file begins with a load that was not read and
/// that the law remembers (history_before_window()): E then holds what S does not remember.
void lack_history(RecordingComparison& comparison, const LawFile& law,
                  const PreparedRecording& recording);

/// Sets limit, verdict, p-value and Holm's rejection of each quantity, what must shrink, and the
/// verdict of all.
/// @param response dimension of the recording's response
/// @param peak of the readings, SI: what a share of a quantity that is hardly known counts of, or
///             the largest that was compared
void judge_quantities(RecordingComparison& recording, const std::optional<Requirement>& requirement,
                      Dimension response, double peak);

/// That of several: adequate only if all are, not adequate (or seen) if Holm's procedure rejects
/// one.
[[nodiscard]] ModelVerdict verdict_of_all(const std::vector<QuantityComparison>& quantities);

}  // namespace tpm::fit
