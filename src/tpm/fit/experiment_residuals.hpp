#pragma once
#include <memory>
#include <string>
#include <vector>

#include "tpm/fit/config.hpp"
#include "tpm/fit/least_squares.hpp"

namespace tpm {

/// One reading as the fit sees it.
struct FitDatum {
  std::string dataset;
  std::string label;  ///< "2 mm, peak"
  Observable observable = Observable::contact_force;
  double time_s = 0.0;  ///< in the protocol's own time; infinite for a static reading
  std::optional<double> value, lower, upper;  ///< SI
  double sigma = 0.0;                         ///< after the noise model
  Provenance provenance = Provenance::assumed;
  bool held_out = false;
};

/// A protocol and the readings taken along it.
struct Experiment {
  Protocol protocol;
  std::vector<double> times_s;
  std::vector<std::size_t> data;  ///< index into FitProblem::data, one per time
  std::size_t choice = 0;         ///< index into FitConfig::data, for the noise
};

/// The residuals of a configuration: experiments asked of the model, compared with data.
class ExperimentResiduals final : public ResidualFunction {
 public:
  /// Loads the data sets and sets the experiments up. Throws Error(bad_input).
  explicit ExperimentResiduals(const FitConfig& config);

  /// The same with data given in memory (simulation studies): one vector of point sets parallel to
  /// config.data.
  ExperimentResiduals(const FitConfig& config, const std::vector<PointSet>& data);

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

  /// All model parameters for given estimated ones.
  [[nodiscard]] TpmVector model_parameters(std::span<const double> natural) const;

 private:
  void add_points(std::size_t choice, const PointSet& points);
  void add_recording(std::size_t choice);
  void count_residuals();
  [[nodiscard]] const Noise& noise(std::size_t choice) const { return config_.data[choice].noise; }

  FitConfig config_;
  std::unique_ptr<Model> model_;
  std::vector<FitDatum> data_;
  std::vector<Experiment> experiments_;
  Eigen::Index residual_count_ = 0;
  double offset_ = 0.0;
};

}  // namespace tpm
