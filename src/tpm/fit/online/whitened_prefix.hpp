#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {

/// Whitened residuals (answer less reading, over sigma) of what has been recorded so far. Refers to
/// the model and the configuration it is made from.
class WhitenedPrefix final : public ResidualFunction {
 public:
  WhitenedPrefix(const LawModel& model, const FitConfig& config, const PreparedRecording& recording,
                 AutoregressiveNoise noise, double sigma);

  [[nodiscard]] Eigen::Index residual_count() const override { return std::ssize(time_s_); }
  [[nodiscard]] std::span<const double> time_s() const { return time_s_; }
  void set_noise(AutoregressiveNoise noise) { noise_ = noise; }

  /// Plain residuals and their derivatives by the natural parameters.
  [[nodiscard]] bool plain(std::span<const double> natural, Eigen::VectorXd& residual,
                           RowMatrix* jacobian) const;
  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override;
  [[nodiscard]] bool linear_in(std::size_t parameter) const override;

 private:
  const LawModel& model_;
  const FitConfig& config_;
  Protocol protocol_;
  AutoregressiveNoise noise_;
  double sigma_;
  std::vector<double> time_s_, observed_;
};

/// True if least squares with this matrix of normal equations have one answer.
[[nodiscard]] bool tells_apart(const Eigen::MatrixXd& gram);

/// The least of the ends of searches from some starts; not usable if there is none.
[[nodiscard]] Minimum least_of(const WhitenedPrefix& function,
                               std::span<const FitParameter> parameters,
                               const std::vector<std::vector<double>>& starts);

/// Places of the parameters that stand on no bound.
[[nodiscard]] std::vector<Eigen::Index> off_bounds(std::span<const FitParameter> parameters,
                                                   std::span<const double> natural);

/// Improves a point and the correlation of the noise in turn. None where the data do not tell the
/// parameters apart.
[[nodiscard]] std::optional<AutoregressionEstimate> improve_in_turn(
    WhitenedPrefix& function, std::span<const FitParameter> parameters, AutoregressiveNoise& noise,
    Minimum& best);

}  // namespace tpm::fit
