#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/likelihood/parameter.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/predict/organ_readings.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/bond_material.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {

/// Contact point and zero error of a recording.
struct RecordingPlacement {
  double contact_m = 0.0, offset_N = 0.0;
};

/// The motion under which an organ is to answer as a law does.
struct MaterialMotion {
  std::string name;   ///< of the recording; empty: a protocol
  Protocol protocol;  ///< depths from the surface
  std::vector<double> time_s;
  /// Of a recording: its readings less the law's offset, N, at `time_s`; else empty.
  std::vector<double> measured_N = {};
  /// Of a recording: its drive as recorded. `protocol` is what lies beyond the law's contact.
  std::optional<Protocol> drive = std::nullopt;
  RecordingPlacement placement = {};             ///< of the recording, by the law
  Provenance provenance = Provenance::measured;  ///< of the recording
};

/// The motion of a recording's ramp and hold, in as few straight pieces as keep it within 0.2 % of
/// its depth. Contact and offset are those of the law if it was fitted to this recording alone;
/// else they are found for it, the law fixed; what `held` says of them is kept.
[[nodiscard]] MaterialMotion motion_of_recording(const LawFile& law,
                                                 const PreparedRecording& recording,
                                                 const PredictionOptions& held = {});
/// @param times_s rising, within the protocol
[[nodiscard]] MaterialMotion motion_of_protocol(const Protocol& protocol,
                                                std::vector<double> times_s);

/// Data that the bonds are fitted to, and the source of their intervals.
enum class MaterialIntervals {
  law,       ///< fitted to the law's force; the law's covariance, carried over to the bonds
  readings,  ///< fitted to the readings; their scatter, from derivatives at the estimate
  profiles,  ///< fitted to the readings; likelihood profiles
};

/// "law", "readings", "profiles".
[[nodiscard]] std::string_view intervals_name(MaterialIntervals intervals) noexcept;
[[nodiscard]] MaterialIntervals parse_intervals(std::string_view text, std::string_view where);

struct OrganMaterialOptions {
  bool fit_times = false;  ///< relaxation times, too; else those of the law are kept
  /// True if bonds stiffen (W = l (1 + (l/s)^2)); none: if the law does.
  std::optional<bool> stiffens;
  /// The branches act on the stiffening W, too, not on l: servo models do not take that.
  bool branches_stiffen = false;
  MaterialIntervals intervals = MaterialIntervals::law;
};

/// One fitted parameter of the bonds, SI.
struct OrganMaterialParameter {
  FitParameter parameter;
  double start = 0.0;   ///< by correspondence
  double by_law = 0.0;  ///< fitted to the law's force
  double value = 0.0;   ///< the same, unless the readings were fitted
  /// Of the interval. None: the law carries no uncertainty, the value stands on a bound, or the
  /// readings do not limit it on that side.
  std::optional<double> lower, upper;
  bool at_bound = false;
};

/// Difference of one force from another, in parts of the law's peak force.
struct ForceMismatch {
  double largest = 0.0, rms = 0.0;
  double at_s = 0.0, depth_m = 0.0, rate_m_per_s = 0.0;  ///< where it is largest
  std::string recording{};                               ///< and in which
};

/// The forces along one motion. Those of a recording are less the law's offset.
struct MaterialCourse {
  std::string name;  ///< of the recording; empty: a protocol
  std::vector<double> time_s, depth_m, law_N, correspondence_N, organ_N, measured_N;
  Provenance provenance = Provenance::measured;  ///< of the recording
  RecordingPlacement by_law;                     ///< that of the law
  RecordingPlacement by_organ;  ///< that of the organ: another one if the readings were fitted
  ForceMismatch organ;          ///< fitted organ less law
  std::optional<ForceMismatch> law_to_recording, organ_to_recording;
};

/// A law put on an organ.
struct OrganMaterial {
  std::string law;
  LawFile fitted_law;                       ///< with what its fit knows of it
  std::vector<std::string> samples_sha256;  ///< of the law's recordings (sample_digests)
  std::string motion;                       ///< "along recording.csv"
  BondMaterial material;
  std::vector<OrganMaterialParameter> parameters;
  MaterialIntervals intervals = MaterialIntervals::law;
  std::optional<ReadingsFit> readings;  ///< if they were fitted
  /// Of the fitted parameters' theta, from the law's covariance, in their order; rows at bounds are
  /// 0; empty without.
  Eigen::MatrixXd covariance;
  /// D: how theta follows the coordinates of the law's uncertainty, one column each; 0 for the
  /// contact and offset of a recording.
  Eigen::MatrixXd follows;
  double level = 0.95;
  double quantile = 0.0;  ///< of the law's uncertainty
  std::vector<MaterialCourse> courses;
  double peak_N = 0.0;       ///< of the law along all of them
  ForceMismatch start;       ///< organ by correspondence, less law
  ForceMismatch organ;       ///< fitted organ less law
  ForceMismatch ramp, hold;  ///< the same while the depth changes and while it does not
  std::optional<ForceMismatch> law_to_recording, organ_to_recording;
  Json scene;    ///< with the fitted material
  Json session;  ///< for tpm hil run: the network stepped in every period
  std::vector<Remark> remarks;
};

/// Fits the material of an organ's bonds until its contact answers as the law does.
///
/// Starts from correspondence: if every bond, lateral ones included, relaxes by the law's
/// normalised function, the contact of a network of small displacements relaxes by it, too; one
/// factor on all moduli is left, and is found by least squares. From there Einf, every g_j and (if
/// asked for) tau_j and the stiffening length minimise the sum of squares of organ less law over
/// the motion; the lateral modulus keeps its ratio to the radial instantaneous one. The covariance
/// follows from that of the law, with J and L the derivatives of the organ's and of the law's
/// force:
///
///     Cov = D C D',   D = (J'J)^-1 J' L.
///
/// If readings are asked for, the search goes on from there with organ less readings, every
/// recording with a contact and an offset of its own (fit_to_readings). Several motions are rows of
/// one sum of squares.
///
/// @param motions one or more
/// @param scene an organ, with no contact or one of the kind sphere; its regions stay
/// @param folder that a mesh path is relative to
/// Throws Error(bad_input) for a law that is no depth with branches, a scene of other contacts, a
/// motion that does not press, readings asked for without a recording; Error(numerical) if the
/// organ cannot be run.
[[nodiscard]] OrganMaterial put_on_organ(const LawFile& law,
                                         const std::vector<MaterialMotion>& motions,
                                         const Json& scene, std::string_view where,
                                         const std::filesystem::path& folder,
                                         const OrganMaterialOptions& options);

[[nodiscard]] Json to_json(const OrganMaterial& result);
[[nodiscard]] std::string to_terminal_text(const OrganMaterial& result);
/// recording (1, 2, ...), time_s, depth_m and every force, SI.
[[nodiscard]] std::string to_csv(const OrganMaterial& result);

}  // namespace tpm::fit
