#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/data/phases.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// Finds the phases and chooses the window. After a step, which the ramp's samples do not show, the
/// window begins when as much time as twice that of the step has passed and the readings have
/// stopped ringing. Throws Error(bad_input) if there is nothing to fit.
[[nodiscard]] PreparedRecording prepare_recording(std::string name, Recording recording,
                                                  const PhaseOptions& options = {});

/// Moves the start of the window to a few samples before contact: for fits that do not take the
/// zero that the rest measured.
void keep_baseline(PreparedRecording& recording);

/// Parameters of a recording and not of the material.
enum class Nuisance {
  automatic,  ///< offset always; contact where the data can tell the two apart
  none,
  offset,
  offset_and_contact,
};

class PlacementMemory;

/// Settings of an automatic configuration.
struct SetupOptions {
  Nuisance nuisance = Nuisance::automatic;
  std::size_t starts = 40;
  std::uint64_t seed = 0;
  double level = 0.95;
  bool profiles = true;
  /// Depth (or change of relative length) that the coefficients refer to; reference_drive() if
  /// nobody says.
  std::optional<double> reference;
  /// Exponent that power kernels keep, where the probe's shape gives it: 2 of a cone.
  std::optional<double> exponent;
  std::vector<double> times_s;    ///< relaxation times that are stated, not fitted; empty: none are
  std::optional<double> contact;  ///< depth of contact that is held, SI; none: measured
  std::optional<double> zero;     ///< reading without a load that is held, SI; none: measured
  /// True if what was measured of zero, contact and drift enters the fit (measure_placement).
  bool measured = true;
  /// Of a choice among laws, so that each placement is measured once; none: measured each time.
  std::shared_ptr<PlacementMemory> placements = nullptr;
  std::function<bool()> interrupted;  ///< see FitConfig
};

/// Bounds and start with no more digits than people read.
[[nodiscard]] FitParameter readable(FitParameter fit);

/// A reference depth for the kernels: the largest drive above contact among the recordings, to two
/// digits.
[[nodiscard]] double reference_drive(std::span<const PreparedRecording> recordings);

/// A reference depth that every recording reaches: the least of their own.
[[nodiscard]] double common_reference(std::span<const PreparedRecording> recordings);

/// The configuration that fits one law to the recordings together: bounds and starts from the
/// recordings, an offset (and contact) of its own for each, normal noise of unknown size (or the
/// recordings' own standard deviations up to one factor). All recordings must have the same drive
/// and response; otherwise Error(bad_input).
[[nodiscard]] FitConfig recording_config(LawSpec law, std::span<const PreparedRecording> recordings,
                                         const SetupOptions& options);

/// The recordings as the fit takes them.
[[nodiscard]] std::vector<DataSet> data_sets(std::span<const PreparedRecording> recordings);

/// The configuration file that tpm fit reads, with the same meaning.
[[nodiscard]] Json config_json(const FitConfig& config);

/// Offset, and contact of an indentation. The slack length of a strip belongs to the specimen,
/// unless recordings that were fitted together have their own (has_own_slack()).
[[nodiscard]] bool belongs_to_recording(const LawSpec& spec, const LawParameter& parameter);

/// What is fitted of a recording beside a given material.
enum class FittedPlacement {
  offset_or_contact,  ///< belongs_to_recording
  slack_too,          ///< the slack length of a strip as well
};

/// Fits what belongs to a recording, with the parameters of the material as given.
/// @param values of the whole law
[[nodiscard]] FitResult fit_placement(const LawSpec& law, std::span<const double> values,
                                      const PreparedRecording& recording, const SetupOptions& setup,
                                      FittedPlacement what = FittedPlacement::offset_or_contact);

}  // namespace tpm::fit
