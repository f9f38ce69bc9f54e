#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tpm/fit/likelihood/estimated_sigma.hpp"
#include "tpm/fit/likelihood/experiment.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpmkit/law_uncertainty.hpp"

namespace tpm::fit {

struct RoundedLevels;

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
  [[nodiscard]] bool information_root(std::span<const double> natural,
                                      RowMatrix& root) const override;
  [[nodiscard]] double offset() const override { return offset_; }
  [[nodiscard]] bool linear_in(std::size_t parameter) const override { return linear_[parameter]; }
  [[nodiscard]] const ExperimentResiduals* surrogate() const override { return surrogate_.get(); }
  [[nodiscard]] const ExchangeOrder& exchange_order() const override { return order_; }

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

  /// Factor of the residuals of priors, > 0: the size of a reading's noise in units of the declared
  /// one, where that is only known up to a factor. 1 at first.
  void set_prior_weight(double weight);

  /// Size of a reading's noise in units of the declared one, > 0: from then on censored readings
  /// count by their likelihood. At first nothing is asked of them.
  void set_noise_scale(double scale);
  [[nodiscard]] bool has_censored() const;

  /// Sets how often each datum counts, in the order of data(); 0 leaves it out.
  void set_counts(std::vector<int> counts);

  /// Holds outliers out, which stay among the data.
  void leave_out(std::span<const std::size_t> outliers);

  /// The same experiments, with data that can be replaced apart from these.
  [[nodiscard]] std::unique_ptr<ExperimentResiduals> copy() const;
  /// Noise e of measured drives adds f(e) to the residuals, which the law answers as if e were
  /// motion: d/dtheta E|f(e)|^2 / 2 by the estimated parameters, natural; none if the drives show
  /// no noise at rest, before the fitted samples. The noise of those samples is taken for white,
  /// and the law for linear in it: the expectation is then a sum over the samples of the drive.
  /// Moving every eighth sample by one standard deviation, up or down at random, gives the part of
  /// these samples, but for what the law remembers eight samples later, which is as often positive
  /// as negative (probing: Tang and Saad 2012). Eight such answers make up the sum.
  [[nodiscard]] std::optional<Eigen::VectorXd> drive_noise_slope(
      std::span<const double> natural) const;
  /// Errors of drives that were rounded to coarse steps (rounded_levels): readings of one level
  /// share one error (RoundedLevels::error_sd), which the law answers as if it were motion. What
  /// they add to the slope of half the sum of squares by the estimated parameters, natural: the sum
  /// of the squares and products of these vectors is the covariance of the slope. One vector for
  /// each hold, of one standard deviation; those of the levels that a motion passes, which are many
  /// and small, are 8 draws of all of them, up or down at random. Empty without such drives.
  [[nodiscard]] std::vector<Eigen::VectorXd> drive_rounding_slopes(
      std::span<const double> natural) const;
  /// A copy with at most about `most` samples of each recording, evenly taken from the history and
  /// from the response: for the search of starts only.
  [[nodiscard]] std::unique_ptr<ExperimentResiduals> thinned(std::size_t most) const;

  /// Scale of the noise law of a value, given the model's answer to it.
  [[nodiscard]] double noise_scale(std::size_t datum, double answer,
                                   std::span<const double> natural) const;
  /// The same for a new reading at the model's answer, which no datum is known of.
  [[nodiscard]] double new_noise_scale(std::size_t datum, double answer,
                                       std::span<const double> natural) const;
  /// (T(answer) - T(value)) / scale; of a band the distance to it. Infinite where the answer has no
  /// likelihood.
  [[nodiscard]] double standardised(std::size_t datum, double answer,
                                    std::span<const double> natural) const;

  /// With the start and bounds of noise parameters that follow from the data.
  [[nodiscard]] const FitConfig& config() const { return config_; }
  [[nodiscard]] const Model& model() const { return *model_; }

 private:
  /// sigma = a + b |model| of a data set, and where a and b stand among the parameters.
  struct MovingSigma {
    EstimatedSigma sigma;
    std::optional<std::size_t> a, b;

    [[nodiscard]] double value_a(std::span<const double> natural) const;
    [[nodiscard]] double value_b(std::span<const double> natural) const;
  };

  ExperimentResiduals() = default;
  /// Moves the knots of an experiment's drive; false if it leaves them.
  using MoveKnots = std::function<bool(const Experiment&, std::vector<Knot>&)>;
  /// A copy with other drives of its recordings; null if none was moved.
  [[nodiscard]] std::unique_ptr<ExperimentResiduals> with_moved_drives(const MoveKnots& move) const;
  /// Error of a level in its standard deviations, by recording and level, and whether it is held.
  using LevelError = std::function<double(std::size_t, std::size_t, bool)>;
  /// A copy with rounding errors of the drives; null if no drive was rounded, or all errors are 0.
  /// @param found levels of the recordings' drives in their order; if empty they are determined
  [[nodiscard]] std::unique_ptr<ExperimentResiduals> with_other_rounding(
      std::vector<RoundedLevels>& found, const LevelError& error_of) const;
  /// A copy with that noise in every `every`-th sample from `first` on; null if there is none.
  [[nodiscard]] std::unique_ptr<ExperimentResiduals> with_noisier_drives(std::size_t first,
                                                                         std::size_t every) const;
  /// Factor of a datum's residuals.
  [[nodiscard]] double weight(std::size_t datum) const;
  /// The model's answer to an experiment, one value per reading.
  /// @param natural estimated parameters
  [[nodiscard]] Response respond_to(const Experiment& experiment, std::span<const double> natural,
                                    Want want) const;
  /// Largest value that is fitted of a data set, SI. Throws Error(bad_input) if all are 0.
  [[nodiscard]] double data_size(std::size_t choice) const;
  void resolve_noise_parameters();
  void resolve_noise_parameter(EstimatedParameter& parameter);
  [[nodiscard]] bool is_normal_of_stated_size() const;
  [[nodiscard]] bool expected_information_root(std::span<const double> natural,
                                               RowMatrix& root) const;
  /// A residual's derivative, times a factor, by the estimated parameters.
  static void write_row(const NoiseTerm& term, const MovingSigma& moving, double factor,
                        const Eigen::Ref<const Eigen::RowVectorXd>& sensitivity,
                        Eigen::Ref<Eigen::RowVectorXd> row);
  void count_residuals();
  [[nodiscard]] std::optional<std::size_t> parameter_place(const std::string& name) const;
  [[nodiscard]] Eigen::VectorXd answers(const std::vector<Experiment>& experiments,
                                        std::span<const double> natural,
                                        RowMatrix* sensitivity) const;
  /// Fills fitted_.
  void leave_out_held_out();
  void set_up_surrogate();
  /// A costly model is asked for derivatives by the estimated parameters only.
  [[nodiscard]] bool asks_along() const { return surrogate_ != nullptr; }
  /// Changes of the model parameters with each of the estimated ones.
  [[nodiscard]] Eigen::MatrixXd changes_for(std::size_t choice) const;
  /// Columns of a response's sensitivity and the estimated parameters that they belong to.
  [[nodiscard]] std::vector<std::pair<Eigen::Index, Eigen::Index>> columns_for(
      std::size_t choice) const;
  [[nodiscard]] const Noise& noise(std::size_t choice) const { return config_.data[choice].noise; }
  /// Two residuals stand for each value: sigma moves with the parameters.
  [[nodiscard]] bool has_normalisation(std::size_t choice) const;

  /// Residuals that are differences times constants: normal noise of stated size, values only.
  struct PlainResiduals {
    Eigen::VectorXd observed, factor;
    std::vector<Eigen::Index> row;  ///< of each datum; -1 of what is held out
  };
  /// Makes residuals independent whose noise is correlated with that of the datum before.
  void decorrelate(const Experiment& experiment, Eigen::VectorXd& residual,
                   RowMatrix* jacobian) const;
  void find_drifts();
  /// The delays of an experiment's rises at these parameters.
  [[nodiscard]] std::vector<DelayedRise> rises_of(const Experiment& experiment,
                                                  std::span<const double> natural) const;
  /// Adds the derivatives by the delays of rises, by differences of answers.
  /// @param response the answer at these parameters
  /// @param place, factor as of add_drifts
  void add_rise_slopes(const Experiment& experiment, std::span<const double> natural,
                       const Response& response, std::span<const Eigen::Index> place,
                       const Eigen::VectorXd* factor, RowMatrix& slopes) const;
  /// Adds the drifts of the zero to the answers of an experiment.
  /// @param place row of each reading; negative: not wanted
  /// @param factor of each row, or null for 1
  void add_drifts(const Experiment& experiment, std::span<const double> natural,
                  std::span<const Eigen::Index> place, const Eigen::VectorXd* factor,
                  Eigen::VectorXd& value, RowMatrix* slopes) const;
  /// The residuals of priors, in the last rows.
  void put_priors(std::span<const double> natural, Eigen::VectorXd& residual,
                  RowMatrix* jacobian) const;
  void find_linear();
  void set_up_plain();
  void set_plain_value(std::size_t datum);
  [[nodiscard]] bool is_plain() const;
  void evaluate_plain(std::span<const double> natural, Eigen::VectorXd& residual,
                      RowMatrix* jacobian) const;
  /// Experiments without what is held out.
  [[nodiscard]] const std::vector<Experiment>& fitted() const {
    return fitted_.empty() ? experiments_ : fitted_;
  }

  FitConfig config_;
  std::shared_ptr<const Model> model_;
  std::vector<FitDatum> data_;
  std::vector<Experiment> experiments_;
  std::vector<Experiment> fitted_;  ///< without what is held out; empty if nothing is
  std::vector<std::optional<MovingSigma>> moving_sigma_;  ///< of each data set
  std::vector<int> counts_;                               ///< empty: every datum counts once
  std::vector<bool> linear_;         ///< of each estimated parameter: linear_in
  std::vector<std::size_t> drifts_;  ///< estimated parameters that are a drift
  std::vector<std::size_t> rises_;   ///< those that are the delay of a rise
  double prior_weight_ = 1.0;
  std::optional<double> noise_scale_;  ///< see set_noise_scale
  ExchangeOrder order_;
  std::optional<PlainResiduals> plain_;
  std::unique_ptr<ExperimentResiduals> surrogate_;  ///< the same, asking the model's surrogate
  Eigen::Index residual_count_ = 0;
  double offset_ = 0.0;
};

}  // namespace tpm::fit
