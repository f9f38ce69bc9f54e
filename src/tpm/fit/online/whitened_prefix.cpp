#include "tpm/fit/online/whitened_prefix.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace tpm::fit {
namespace {

constexpr double kLeastPivot = 1e-10;  // of a gram matrix with columns of length 1

/// The correlation of the noise at a point; none where the data do not tell the parameters apart.
std::optional<AutoregressionEstimate> correlation_near(const WhitenedPrefix& function,
                                                       std::span<const FitParameter> parameters,
                                                       std::span<const double> natural,
                                                       double step_s) {
  Eigen::VectorXd residual;
  RowMatrix jacobian;
  if (!function.plain(natural, residual, &jacobian)) return std::nullopt;
  jacobian = jacobian * natural_slopes(parameters, theta_of(parameters, natural)).asDiagonal();
  const Eigen::MatrixXd columns = jacobian(Eigen::all, off_bounds(parameters, natural));
  const bool enough = columns.cols() > 0 && residual.size() > columns.cols() + 2;
  if (!enough || !(residual.squaredNorm() > 0.0)) return std::nullopt;
  if (!tells_apart(columns.transpose() * columns)) return std::nullopt;
  return estimate_autoregression(function.time_s(), residual, columns, step_s);
}

}  // namespace

WhitenedPrefix::WhitenedPrefix(const LawModel& model, const FitConfig& config,
                               const PreparedRecording& recording, AutoregressiveNoise noise,
                               double sigma)
    : model_(model),
      config_(config),
      protocol_(measured_history(Drive::displacement, recording.recording.time_s,
                                 recording.recording.drive)),
      noise_(noise),
      sigma_(sigma) {
  protocol_.set_equilibrium_at_start(true);
  const Recording& r = recording.recording;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.time_s[i] < recording.from_s || r.time_s[i] > recording.to_s) continue;
    time_s_.push_back(r.time_s[i]);
    observed_.push_back(r.response[i]);
  }
}

bool WhitenedPrefix::plain(std::span<const double> natural, Eigen::VectorXd& residual,
                           RowMatrix* jacobian) const {
  const std::vector<double> values = model_parameters(config_, natural, 0);
  const Response response =
      model_.respond(protocol_, time_s_, values,
                     jacobian == nullptr ? Want::values : Want::values_and_sensitivity);
  if (!response.value.allFinite()) return false;
  residual = response.value - Eigen::VectorXd::Map(observed_.data(), std::ssize(observed_));
  if (jacobian == nullptr) return true;
  jacobian->setZero(residual.size(), std::ssize(config_.parameters));
  for (std::size_t i = 0; i < config_.parameters.size(); ++i) {
    for (const Target& target : config_.parameters[i].sets) {
      jacobian->col(static_cast<Eigen::Index>(i)) +=
          response.sensitivity.col(static_cast<Eigen::Index>(target.parameter));
    }
  }
  return true;
}

bool WhitenedPrefix::evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const {
  if (!plain(natural, residual, jacobian)) return false;
  residual /= sigma_;
  noise_.whiten(time_s_, residual);
  if (jacobian != nullptr) {
    *jacobian /= sigma_;
    noise_.whiten(time_s_, *jacobian);
  }
  return true;
}

bool WhitenedPrefix::linear_in(std::size_t parameter) const {
  const EstimatedParameter& p = config_.parameters[parameter];
  return p.fit.scale == Scale::linear && model_.linear_in(p.sets.front().parameter);
}

bool tells_apart(const Eigen::MatrixXd& gram) {
  const Eigen::VectorXd length = gram.diagonal().cwiseSqrt();
  if (!(length.minCoeff() > 0.0)) return false;
  const Eigen::VectorXd inverse = length.cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> scaled(inverse.asDiagonal() * gram * inverse.asDiagonal());
  return scaled.vectorD().minCoeff() > kLeastPivot;
}

Minimum least_of(const WhitenedPrefix& function, std::span<const FitParameter> parameters,
                 const std::vector<std::vector<double>>& starts) {
  Minimum best;
  for (const auto& start : starts) {
    Minimum end = minimise_near(function, parameters, start);
    if (end.usable && (!best.usable || end.deviance < best.deviance)) best = std::move(end);
  }
  return best;
}

std::vector<Eigen::Index> off_bounds(std::span<const FitParameter> parameters,
                                     std::span<const double> natural) {
  std::vector<Eigen::Index> free;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].at_lower(natural[i]) || parameters[i].at_upper(natural[i])) continue;
    free.push_back(static_cast<Eigen::Index>(i));
  }
  return free;
}

std::optional<AutoregressionEstimate> improve_in_turn(WhitenedPrefix& function,
                                                      std::span<const FitParameter> parameters,
                                                      AutoregressiveNoise& noise, Minimum& best) {
  constexpr int kRounds = 3;
  constexpr double kSame = 0.02;  // of 1 - phi: changes widths by 2 %
  std::optional<AutoregressionEstimate> correlation;
  std::vector<Eigen::Index> free;  // whose slopes it has
  for (int round = 0; round < kRounds; ++round) {
    free = off_bounds(parameters, best.natural);
    correlation = correlation_near(function, parameters, best.natural, noise.step_s());
    if (!correlation) return std::nullopt;
    const double change = std::abs(correlation->phi - noise.phi());
    noise = AutoregressiveNoise(correlation->phi, noise.step_s());
    function.set_noise(noise);
    if (change < kSame * (1.0 - noise.phi())) break;
    Minimum again = minimise_near(function, parameters, best.natural);
    if (!again.usable) break;
    best = std::move(again);
  }
  // The last minimum may have taken a parameter to a bound, or off it.
  if (off_bounds(parameters, best.natural) == free) return correlation;
  return correlation_near(function, parameters, best.natural, noise.step_s());
}

}  // namespace tpm::fit
