#pragma once
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/likelihood/oscillation.hpp"

namespace tpm::fit {

/// One reading as the fit sees it.
struct FitDatum {
  std::size_t choice = 0;                       ///< place in FitConfig::data
  std::string label;                            ///< "2 mm, peak"; empty for a sample of a recording
  Quantity quantity = Quantity::contact_force;  ///< what was read
  double time_s = 0.0;  ///< in the protocol's own time; infinite for a static reading
  std::optional<double> frequency_Hz;         ///< of an oscillation, which has no time
  std::optional<double> value, lower, upper;  ///< SI
  /// A censored reading, at a limit of the force cell: it has no value, but a band that is open
  /// beyond the limit.
  std::optional<double> at_limit = std::nullopt;
  double sigma = 0.0;  ///< after the noise model; 0 where it is estimated
  /// Of its noise with that of the datum before it: the storage beside the loss of a frequency
  /// whose magnitude and phase were measured.
  double correlation = 0.0;
  Provenance provenance = Provenance::assumed;
  bool held_out = false;
  bool outlier = false;  ///< held out because it is none of the curve's noise
};

/// "2 mm, peak", or the time of a sample.
[[nodiscard]] std::string datum_label(const FitDatum& datum);

/// A history and the times of the readings along it.
struct TimeCourse {
  Protocol protocol;
  std::vector<double> times_s;
  /// Protocol that drives an organ in place of a measured history; none: the history itself.
  std::optional<Protocol> followed = std::nullopt;

  [[nodiscard]] const Protocol& driven() const { return followed ? *followed : protocol; }
};

/// Imposed protocol, and the readings taken.
struct Experiment {
  std::variant<TimeCourse, Oscillation> imposed;
  /// Index into ExperimentResiduals::data(), one per time or reading of an oscillation.
  std::vector<std::size_t> data;
  std::size_t choice = 0;  ///< place in FitConfig::data
  bool is_recording = false;
};

/// Data in memory: separate readings, a recording, or storage and loss over frequency.
using DataSet = std::variant<PointSet, Recording, Spectrum>;

/// Experiments of the data sets of a fit.
struct ExperimentSet {
  std::vector<FitDatum> data;
  std::vector<Experiment> experiments;
};

/// The file of a data set, or the id of a shipped curve.
[[nodiscard]] std::string data_path(const FitConfig& config, const std::string& dataset);

/// The data sets that the configuration names, read. Throws Error(bad_input).
[[nodiscard]] std::vector<DataSet> load_data(const FitConfig& config);

/// Experiments in the order of the data sets, in each one per imposed depth or load, recording or
/// spectrum.
/// @param data one for each of config.data
/// Throws Error(bad_input) for data that do not fit their protocol or noise.
[[nodiscard]] ExperimentSet set_up_experiments(const FitConfig& config,
                                               const std::vector<DataSet>& data);

/// Scale of the noise of a value; 0 where it is among the estimated parameters.
/// @param where for messages
[[nodiscard]] double value_sigma(const DataChoice& data, double value, std::optional<double> row_sd,
                                 const std::string& where);

}  // namespace tpm::fit
