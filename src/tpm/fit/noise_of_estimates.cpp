#include "tpm/fit/noise_of_estimates.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/likelihood/correlation.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/likelihood/quantum.hpp"
#include "tpm/fit/noise_rows.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

bool has_plain_residuals(const ExperimentResiduals& function) {
  const FitConfig& config = function.config();
  if (config.loss.kind != Loss::none) return false;
  for (const DataChoice& d : config.data) {
    if (d.noise.shape != ErrorShape::normal || d.estimates_sigma()) return false;
    if (d.noise.kind == NoiseKind::relative_to_model) return false;
  }
  const Eigen::Index rows = function.value_count() + function.band_count() + prior_count(config);
  return function.residual_count() == rows;
}

/// R(phi) times columns.
Eigen::MatrixXd correlated_columns(const AutoregressiveNoise& noise,
                                   const std::vector<double>& time_s, const Eigen::MatrixXd& of) {
  Eigen::MatrixXd spread = of;
  if (noise.phi() == 0.0) return spread;
  Eigen::RowVectorXd forth = Eigen::RowVectorXd::Zero(of.cols()), back = forth;
  for (Eigen::Index i = 1; i < of.rows(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    forth = noise.correlation(time_s[k] - time_s[k - 1]) * (forth + of.row(i - 1));
    spread.row(i) += forth;
  }
  for (Eigen::Index i = of.rows() - 2; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    back = noise.correlation(time_s[k + 1] - time_s[k]) * (back + of.row(i + 1));
    spread.row(i) += back;
  }
  return spread;
}

/// Estimates of least squares, columns scaled to length 1.
class Estimates {
 public:
  explicit Estimates(const NoiseRows& rows) : rows_(rows) {
    length_ = rows.jacobian.colwise().norm().transpose();
    if (!(length_.minCoeff() > 0.0)) return;
    scaled_ = rows.jacobian * length_.cwiseInverse().asDiagonal();
    constexpr double kRankTolerance = 1e-10;
    const RightSingular singular = right_singular(scaled_);
    if (!(singular.values[singular.values.size() - 1] > kRankTolerance)) return;
    const Eigen::MatrixXd root = singular.vectors * singular.values.cwiseInverse().asDiagonal();
    bread_ = root * root.transpose();
    const Eigen::Index priors = rows.priors();
    Eigen::MatrixXd last = scaled_.bottomRows(priors);
    for (Eigen::Index i = 0; i < priors; ++i) {
      last.row(i) *= rows.prior_weight[static_cast<std::size_t>(i)];
    }
    from_priors_ = bread_ * (last.transpose() * last) * bread_;
  }

  [[nodiscard]] bool determined() const { return bread_.size() > 0; }
  /// Covariance by readings of marginal variance 1.
  [[nodiscard]] Eigen::MatrixXd by_readings(double phi) const {
    const Eigen::MatrixXd j = scaled_.topRows(rows_.values());
    const Eigen::MatrixXd r =
        correlated_columns(AutoregressiveNoise(phi, rows_.step_s), rows_.time_s, j);
    return bread_ * (j.transpose() * r) * bread_;
  }
  [[nodiscard]] const Eigen::MatrixXd& by_priors() const { return from_priors_; }
  /// Covariance by what the noise of a rest did to both its priors and the readings behind it.
  /// @param variance of a reading, in units of the declared one
  [[nodiscard]] Eigen::MatrixXd by_rests(double phi, double variance) const {
    const AutoregressiveNoise noise(phi, rows_.step_s);
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(bread_.rows(), bread_.cols());
    for (std::size_t k = 0; k < rows_.at_rest.size(); ++k) {
      if (!rows_.at_rest[k] || rows_.recordings[k].count == 0) continue;
      const MeasuredAtRest& rest = *rows_.at_rest[k];
      const RecordingRows& fitted = rows_.recordings[k];
      const double begin_s = rows_.time_s[static_cast<std::size_t>(fitted.first)];
      Eigen::RowVectorXd follows = Eigen::RowVectorXd::Zero(bread_.rows());
      for (Eigen::Index i = fitted.first; i < fitted.first + fitted.count; ++i) {
        const double after_s = rows_.time_s[static_cast<std::size_t>(i)] - begin_s;
        follows += noise.correlation(after_s + rows_.step_s) * scaled_.row(i);
      }
      const Eigen::Vector2d with_last = rest.covariance_with_last(variance);
      const Eigen::MatrixXd both =
          follows.transpose() * (with_last[0] * prior_score(rest.zero_prior, rest.zero_sd) +
                                 with_last[1] * prior_score(rest.drift_prior, rest.drift_sd));
      sum += both + both.transpose();
    }
    return bread_ * sum * bread_;
  }
  /// For independent readings of variance 1, all residuals counted alike.
  [[nodiscard]] Eigen::VectorXd plain_variance() const { return bread_.diagonal(); }
  /// sum of |d estimate / d reading| times what each reading may be off.
  [[nodiscard]] Eigen::VectorXd largest_bias(const Eigen::VectorXd& off) const {
    const Eigen::Index values = rows_.values();
    return (bread_ * scaled_.topRows(values).transpose()).cwiseAbs() * off;
  }
  /// Change of the estimates with a slope of half the sum of squares, by the natural parameters.
  [[nodiscard]] Eigen::VectorXd moved_by(const Eigen::VectorXd& slope) const {
    return bread_ * slope.cwiseQuotient(length_);
  }
  [[nodiscard]] const Eigen::VectorXd& length() const { return length_; }

 private:
  /// What an error of a prior's mean adds to the slope of half the sum of squares.
  [[nodiscard]] Eigen::RowVectorXd prior_score(std::size_t prior, double sd) const {
    const Eigen::Index row = rows_.values() + static_cast<Eigen::Index>(prior);
    return rows_.prior_weight[prior] / sd * scaled_.row(row);
  }

  const NoiseRows& rows_;
  Eigen::VectorXd length_;
  Eigen::MatrixXd scaled_, bread_, from_priors_;
};

/// True if generalised least squares at the estimated phi leads away from the estimates of ordinary
/// least squares by more than noise with that phi explains (Hausman, Econometrica 46 (1978) 1251).
/// Then what the law does not meet follows its own derivatives from sample to sample, as the steps
/// of a drive that was recorded in a coarse resolution do, and the phi is none of the noise.
bool is_contradicted(const AutoregressionEstimate& found, const std::vector<double>& time_s,
                     const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian,
                     double step_s) {
  constexpr double kContradicted = 1e-3, kNothing = 1e-6;
  if (!(found.phi > 0.0 && found.variance > 0.0)) return false;
  const AutoregressiveNoise noise(found.phi, step_s);
  const Eigen::VectorXd length = jacobian.colwise().norm().transpose();
  if (!(length.minCoeff() > 0.0)) return false;
  const Eigen::MatrixXd j = jacobian * length.cwiseInverse().asDiagonal();
  Eigen::MatrixXd white_j = j;
  Eigen::VectorXd white_r = residual;
  noise.whiten(time_s, white_j);
  noise.whiten(time_s, white_r);
  const Eigen::LLT<Eigen::MatrixXd> gram(white_j.transpose() * white_j);
  const Eigen::LLT<Eigen::MatrixXd> plain(j.transpose() * j);
  if (gram.info() != Eigen::Success || plain.info() != Eigen::Success) return false;
  const Eigen::MatrixXd spread = j.transpose() * correlated_columns(noise, time_s, j);
  const Eigen::MatrixXd bread = plain.solve(Eigen::MatrixXd::Identity(j.cols(), j.cols()));
  const Eigen::MatrixXd root = gram.matrixU();
  // Both covariances in units of the one of generalised least squares.
  const Eigen::MatrixXd more = root * (bread * spread * bread) * root.transpose() -
                               Eigen::MatrixXd::Identity(j.cols(), j.cols());
  const Eigen::VectorXd away =
      root * gram.solve(white_j.transpose() * white_r) / std::sqrt(found.variance);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(0.5 * (more + more.transpose()));
  double statistic = 0.0, degrees = 0.0;
  for (Eigen::Index k = 0; k < j.cols(); ++k) {
    if (!(axes.eigenvalues()[k] > kNothing)) continue;
    statistic += std::pow(axes.eigenvectors().col(k).dot(away), 2) / axes.eigenvalues()[k];
    degrees += 1.0;
  }
  return degrees > 0.0 && chi_squared_tail(statistic, degrees) < kContradicted;
}

/// The autoregression of the residuals. Priors count as readings of the same size, which their
/// weight makes of them.
AutoregressionEstimate autoregression_of(const NoiseRows& rows, bool scale_known) {
  constexpr double kHardly = 0.5;
  constexpr Eigen::Index kLong = 20'000;  // beyond, what J follows of the noise is nothing
  Eigen::VectorXd residual = rows.residual;
  Eigen::MatrixXd jacobian = rows.jacobian;
  if (residual.size() > kLong) jacobian = Eigen::VectorXd::Ones(residual.size());
  AutoregressionEstimate estimate;
  double variance = rows.residual.head(rows.values()).squaredNorm() /
                    static_cast<double>(std::max<Eigen::Index>(rows.values() - jacobian.cols(), 1));
  for (int round = 0; round < (rows.priors() > 0 ? 2 : 1); ++round) {
    if (scale_known) variance = 1.0;
    for (Eigen::Index i = 0; i < rows.priors(); ++i) {
      const Eigen::Index row = rows.values() + i;
      const double share = std::sqrt(variance) / rows.prior_weight[static_cast<std::size_t>(i)];
      residual[row] = rows.residual[row] * share;
      if (residual.size() <= kLong) jacobian.row(row) = rows.jacobian.row(row) * share;
    }
    estimate = estimate_autoregression(rows.time_s, residual, jacobian, rows.step_s);
    if (residual.size() <= kLong &&
        is_contradicted(estimate, rows.time_s, residual, jacobian, rows.step_s)) {
      // A law that is wrong is contradicted, too, but leaves residuals that follow each other.
      const AutoregressionEstimate own = estimate_autoregression(
          rows.time_s, residual, Eigen::VectorXd::Ones(residual.size()), rows.step_s);
      if (own.phi < kHardly) estimate = own;
    }
    variance = estimate.variance;
  }
  return estimate;
}

Correlation correlation_of_rows(const NoiseRows& rows, const Eigen::VectorXd& residual) {
  std::vector<std::span<const double>> parts;
  for (const RecordingRows& r : rows.recordings) {
    parts.emplace_back(residual.data() + r.first, static_cast<std::size_t>(r.count));
  }
  return residual_correlation(parts);
}

/// Where the noise is below half a step by more than chance makes it seem, the half steps; 0
/// elsewhere.
/// @param degrees independent readings behind `variance`
Eigen::VectorXd limiting_steps(const NoiseRows& rows, double variance, double degrees) {
  constexpr double kNone = 0.01;  // what is met so much better was not rounded: (q/20)^2
  const Eigen::ArrayXd square = rows.half_step.array().square();
  return (square * hidden_noise_variance(degrees) > variance && square * kNone < variance)
      .select(rows.half_step.array(), 0.0)
      .matrix();
}

/// Bias from noise of the drive, of scaled parameters (drive_noise_slope): the mean of what the
/// slope says here and where the estimates would be without it, where it is steeper (a dashpot
/// answers noise the more the faster it is). Zero where it matters little.
Eigen::VectorXd bias_of_drive_noise(const ExperimentResiduals& function, const Estimates& estimates,
                                    std::span<const FitParameter> parameters,
                                    const std::vector<std::size_t>& free,
                                    std::span<const double> natural, double variance) {
  constexpr double kMatters = 0.25;  // standard errors
  const std::vector<Eigen::Index> columns(free.begin(), free.end());
  const auto here = function.drive_noise_slope(natural);
  Eigen::VectorXd none = Eigen::VectorXd::Zero(estimates.length().size());
  if (!here) return none;
  const Eigen::VectorXd moved = estimates.moved_by((*here)(columns));
  const Eigen::ArrayXd error = (variance * estimates.plain_variance()).array().sqrt();
  if (!(moved.array().abs() > kMatters * error).any()) return none;
  const auto there = function.drive_noise_slope(
      moved_within_bounds(parameters, free, natural, moved.cwiseQuotient(estimates.length())));
  return 0.5 * (moved + (there ? estimates.moved_by((*there)(columns)) : moved)).cwiseAbs();
}

/// Covariance by the rounding of drives, of scaled parameters (drive_rounding_slopes). Empty where
/// it matters little.
Eigen::MatrixXd covariance_of_drive_rounding(const ExperimentResiduals& function,
                                             const Estimates& estimates,
                                             const std::vector<std::size_t>& free,
                                             std::span<const double> natural, double variance) {
  constexpr double kMatters = 0.25;  // standard errors
  const std::vector<Eigen::VectorXd> slopes = function.drive_rounding_slopes(natural);
  if (slopes.empty()) return {};
  const std::vector<Eigen::Index> columns(free.begin(), free.end());
  const Eigen::Index p = estimates.length().size();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(p, p);
  for (const Eigen::VectorXd& slope : slopes) {
    const Eigen::VectorXd moved = estimates.moved_by(slope(columns));
    covariance += moved * moved.transpose();
  }
  const Eigen::ArrayXd square = kMatters * kMatters * variance * estimates.plain_variance();
  if (!covariance.allFinite() || !(covariance.diagonal().array() > square).any()) return {};
  return covariance;
}

/// What makes the estimates scatter beside independent noise of the readings, or biases them.
struct NoiseParts {
  AutoregressionEstimate autoregression;
  bool correlated = false;
  double phi = 0.0;
  double size = 1.0;              ///< seen variance of a reading, in units of the declared one
  double freedom = 1.0;           ///< readings less parameters
  Eigen::VectorXd half_step;      ///< of rounded readings that limit the fit; 0 elsewhere
  Eigen::VectorXd bias_of_drive;  ///< of scaled parameters
  Eigen::MatrixXd by_rounding;    ///< covariance of scaled parameters by a rounded drive, or empty

  [[nodiscard]] bool limited() const { return half_step.size() > 0 && half_step.maxCoeff() > 0.0; }
  [[nodiscard]] bool biased() const { return bias_of_drive.maxCoeff() > 0.0; }
  [[nodiscard]] bool rounded() const { return by_rounding.size() > 0; }
  [[nodiscard]] bool any() const { return correlated || limited() || biased() || rounded(); }
};

/// Size and correlation of the noise of the readings alone.
NoiseParts noise_of_readings(const NoiseRows& rows, bool scale_known, Eigen::Index parameters) {
  constexpr double kSignificant = 5.41;  // chi-square of one degree, one-sided 1 %
  NoiseParts parts;
  const Correlation raw = correlation_of_rows(rows, rows.residual);
  parts.autoregression = autoregression_of(rows, scale_known);
  const AutoregressionEstimate& found = parts.autoregression;
  const bool seen = raw.significant || found.gain > kSignificant;
  parts.correlated = seen && (found.phi > 0.0 || raw.inflation() > 1.0);
  parts.phi = parts.correlated ? found.phi : 0.0;
  parts.freedom = static_cast<double>(rows.residual.size() - parameters);
  parts.size = parts.correlated ? found.variance : rows.residual.squaredNorm() / parts.freedom;
  const double square = parts.phi * parts.phi;
  parts.half_step =
      limiting_steps(rows, parts.size, parts.freedom * (1.0 - square) / (1.0 + square));
  return parts;
}

/// Factor of variances for what an autoregression leaves of the correlation; at least 1.
double left_beyond(const NoiseRows& rows, const AutoregressiveNoise& autoregression) {
  Eigen::VectorXd white = rows.residual;
  autoregression.whiten(rows.time_s, white);
  const Correlation left = correlation_of_rows(rows, white);
  return left.significant ? std::max(left.inflation(), 1.0) : 1.0;
}

/// Fills the covariance and what is told of each estimate.
void set_estimates(NoiseOfEstimates& noise, const NoiseRows& rows, const Estimates& estimates,
                   const NoiseParts& parts, bool scale_known) {
  const double size = noise.variance * noise.beyond;
  const Eigen::MatrixXd readings = size * estimates.by_readings(noise.phi);
  Eigen::MatrixXd all = readings + estimates.by_priors() + estimates.by_rests(noise.phi, size);
  if (parts.rounded()) all += parts.by_rounding;
  const Eigen::VectorXd unscaled = estimates.length().cwiseInverse();
  noise.covariance = unscaled.asDiagonal() * all * unscaled.asDiagonal();
  // Derivatives of ln(variance) by phi, and by the size of the noise.
  const AutoregressionEstimate& found = parts.autoregression;
  const double step = 0.02 * (1.0 - noise.phi) + 1e-6;
  const double below = std::max(noise.phi - step, 0.0), above = noise.phi + step;
  const Eigen::VectorXd slope =
      1.0 / (above - below) *
          (size * (estimates.by_readings(above) - estimates.by_readings(below)) +
           estimates.by_rests(above, size) - estimates.by_rests(below, size))
              .diagonal() +
      (scale_known ? 0.0 : found.log_squares_slope) * readings.diagonal();
  const Eigen::VectorXd plain = estimates.plain_variance();
  const Eigen::VectorXd bias = estimates.largest_bias(parts.half_step) + parts.bias_of_drive;
  const auto n = static_cast<double>(rows.residual.size());
  for (Eigen::Index k = 0; k < plain.size(); ++k) {
    const double by_phi = noise.correlated ? slope[k] / all(k, k) : 0.0;
    const double share = scale_known ? 0.0 : readings(k, k) / all(k, k);
    const double spread =
        by_phi * by_phi * found.phi_variance + share * share * 2.0 / parts.freedom;
    constexpr double kMany = 1e6;
    double degrees = spread > 2.0 / kMany ? 2.0 / spread : kMany;
    if (noise.beyond > 1.0) {
      degrees = std::min(degrees, n / noise.inflation - static_cast<double>(plain.size()));
    }
    noise.of[noise.free[static_cast<std::size_t>(k)]] = {
        all(k, k) / plain[k], std::max(degrees, 1.0), bias[k] / std::sqrt(plain[k])};
  }
}

std::string words_of(const NoiseOfEstimates& noise, const NoiseParts& parts, Eigen::Index samples) {
  std::string words;
  if (noise.correlated) {
    words = fmt::format(
        "noise of neighbouring samples is correlated (phi = {} over {} s, restricted likelihood): "
        "{} readings count as {} independent ones; the intervals count them so",
        significant(noise.phi, 3), significant(noise.step_s, 3), samples,
        significant(static_cast<double>(samples) / noise.inflation, 3));
    if (noise.beyond > 1.0) {
      words += fmt::format("; beyond this, variances are {} times as large",
                           significant(noise.beyond, 3));
    }
  }
  if (parts.biased()) {
    words += fmt::format(
        "{}the noise of the drive, which the law answers, biases estimates; intervals allow for it",
        words.empty() ? "" : "; ");
  }
  if (parts.rounded()) {
    words += fmt::format(
        "{}the drive was rounded to coarse steps, and the law answers the errors; intervals count "
        "them",
        words.empty() ? "" : "; ");
  }
  if (noise.limited) {
    words += fmt::format(
        "{}limited by resolution: the noise is below half a step of the readings, and half a step "
        "is allowed for as a bias of each",
        words.empty() ? "" : "; ");
  }
  return words;
}

}  // namespace

std::optional<NoiseOfEstimates> noise_of_estimates(const ExperimentResiduals& function,
                                                   std::span<const FitParameter> parameters,
                                                   std::span<const double> natural) {
  const FitConfig& config = function.config();
  const bool any = std::ranges::any_of(function.experiments(), &Experiment::is_recording);
  if (!any || !config.adjust_correlation || !has_plain_residuals(function)) return std::nullopt;
  NoiseOfEstimates noise;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!parameters[i].at_lower(natural[i]) && !parameters[i].at_upper(natural[i])) {
      noise.free.push_back(i);
    }
  }
  const auto rows = noise_rows(function, noise.free, natural);
  const Eigen::Index p = std::ssize(noise.free);
  if (!rows || p == 0 || rows->residual.size() < 2 * (p + 1)) return std::nullopt;
  if (!(rows->residual.head(rows->values()).squaredNorm() > 0.0)) return std::nullopt;
  const Estimates estimates(*rows);
  if (!estimates.determined()) return std::nullopt;

  const bool scale_known = config.scale_known();
  NoiseParts parts = noise_of_readings(*rows, scale_known, p);
  if (!scale_known && parts.size < computed_variance(function)) return std::nullopt;
  parts.bias_of_drive =
      bias_of_drive_noise(function, estimates, parameters, noise.free, natural, parts.size);
  parts.by_rounding =
      covariance_of_drive_rounding(function, estimates, noise.free, natural, parts.size);
  if (!parts.any()) return std::nullopt;

  noise.correlated = parts.correlated;
  noise.limited = parts.limited();
  noise.phi = parts.phi;
  noise.step_s = rows->step_s;
  noise.variance = scale_known ? 1.0 : parts.size;
  const AutoregressiveNoise autoregression(noise.phi, noise.step_s);
  if (noise.correlated) noise.beyond = left_beyond(*rows, autoregression);
  const Eigen::MatrixXd ones = Eigen::VectorXd::Ones(rows->values());
  const double repeats = correlated_columns(autoregression, rows->time_s, ones).sum();
  noise.inflation = std::max(noise.beyond * repeats / static_cast<double>(rows->values()), 1.0);
  noise.of.assign(parameters.size(), {});
  set_estimates(noise, *rows, estimates, parts, scale_known);
  noise.summary = words_of(noise, parts, rows->values());
  return noise;
}

}  // namespace tpm::fit
