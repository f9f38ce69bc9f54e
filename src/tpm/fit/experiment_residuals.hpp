#pragma once
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "tpm/fit/config.hpp"
#include "tpm/fit/least_squares.hpp"

namespace tpm {

/// One reading as the fit sees it.
struct FitDatum {
  std::size_t choice = 0;  ///< place in FitConfig::data
  std::string label;       ///< "2 mm, peak"; empty for a sample of a recording
  Observable observable = Observable::contact_force;
  double time_s = 0.0;  ///< in the protocol's own time; infinite for a static reading
  std::optional<double> value, lower, upper;  ///< SI
  double sigma = 0.0;                         ///< after the noise model
  Provenance provenance = Provenance::assumed;
  bool held_out = false;
};

/// "2 mm, peak", or the time of a sample.
[[nodiscard]] std::string datum_label(const FitDatum& datum);

/// A protocol and the readings taken along it.
struct Experiment {
  Protocol protocol;
  std::vector<double> times_s;
  std::vector<std::size_t> data;  ///< index into FitProblem::data, one per time
  std::size_t choice = 0;         ///< place in FitConfig::data
  bool is_recording = false;
};

/// Data in memory: separate readings, or a recording.
using DataSet = std::variant<PointSet, Recording>;

/// The residuals of a configuration: experiments asked of the model, compared with data.
class ExperimentResiduals final : public ResidualFunction {
 public:
  /// Loads the data sets and sets the experiments up. Throws Error(bad_input).
  explicit ExperimentResiduals(const FitConfig& config);

  /// The same with data given in memory, one for each of config.data.
  ExperimentResiduals(const FitConfig& config, const std::vector<DataSet>& data);

  [[nodiscard]] Eigen::Index residual_count() const override { return residual_count_; }
  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override;
  [[nodiscard]] double offset() const override { return offset_; }

  [[nodiscard]] const std::vector<FitDatum>& data() const { return data_; }
  [[nodiscard]] const std::vector<Experiment>& experiments() const { return experiments_; }
  /// Values (not bands) that are fitted.
  [[nodiscard]] int value_count() const;
  [[nodiscard]] int band_count() const;

  /// The model's answer to every datum, held-out ones too, in the order of data().
  /// @param sensitivity d answer / d estimated parameter, or null
  /// Throws Error(numerical) if a response cannot be computed.
  [[nodiscard]] Eigen::VectorXd predict(std::span<const double> natural,
                                        RowMatrix* sensitivity) const;

  /// Replaces the value of a fitted datum and its standard deviation (simulation studies).
  void set_value(std::size_t datum, double value);

  [[nodiscard]] const FitConfig& config() const { return config_; }
  [[nodiscard]] const Model& model() const { return *model_; }

 private:
  void add_points(std::size_t choice, const PointSet& points);
  void add_recording(std::size_t choice, const Recording& recording);
  void count_residuals();
  /// Columns of a response's sensitivity and the estimated parameters that they belong to.
  [[nodiscard]] std::vector<std::pair<Eigen::Index, Eigen::Index>> columns_for(
      std::size_t choice) const;
  [[nodiscard]] const Noise& noise(std::size_t choice) const { return config_.data[choice].noise; }

  FitConfig config_;
  std::unique_ptr<Model> model_;
  std::vector<FitDatum> data_;
  std::vector<Experiment> experiments_;
  Eigen::Index residual_count_ = 0;
  double offset_ = 0.0;
};

}  // namespace tpm
