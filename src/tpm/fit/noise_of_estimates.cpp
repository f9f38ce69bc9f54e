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
#include "tpm/fit/measured_at_rest.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// Rows of one recording among those of all residuals.
struct RecordingRows {
  Eigen::Index first = 0, count = 0;
};

/// The residuals of values, then those of priors.
struct NoiseRows {
  std::vector<double> time_s;  ///< recordings and separate readings far apart
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;          ///< by the free parameters, natural
  Eigen::VectorXd half_step;         ///< of rounding, in units of the declared noise; of values
  std::vector<double> prior_weight;  ///< of each prior's residual
  std::vector<RecordingRows> recordings;
  std::vector<std::optional<MeasuredAtRest>> at_rest;  ///< of each recording
  double step_s = 0.0;

  [[nodiscard]] Eigen::Index priors() const { return std::ssize(prior_weight); }
  [[nodiscard]] Eigen::Index values() const { return residual.size() - priors(); }
};

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

/// Readings without rounding are all different.
bool repeats_itself(std::vector<double> readings) {
  constexpr double kShare = 0.2;
  const auto n = static_cast<double>(readings.size());
  std::ranges::sort(readings);
  // clang 14 cannot read std::ranges::unique of libstdc++ 12.
  const auto repeated =
      std::distance(std::unique(readings.begin(), readings.end()), readings.end());
  return static_cast<double>(repeated) > kShare * n;
}

/// Half the step that the readings of a recording are rounded to, on the scale of the noise.
std::vector<double> half_steps(const ExperimentResiduals& function, const Experiment& experiment) {
  std::vector<double> readings;
  for (const std::size_t i : experiment.data) {
    const FitDatum& d = function.data()[i];
    if (!d.held_out && d.value) readings.push_back(*d.value);
  }
  const bool absolute = function.config().data[experiment.choice].noise.kind != NoiseKind::log;
  const double half = absolute && repeats_itself(readings) ? 0.5 * quantum_of(readings) : 0.0;
  std::vector<double> steps;
  for (const std::size_t i : experiment.data) {
    const FitDatum& d = function.data()[i];
    if (!d.held_out && d.value) steps.push_back(half / d.sigma);
  }
  return steps;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 1.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// None if the residuals cannot be evaluated.
std::optional<NoiseRows> noise_rows(const ExperimentResiduals& function,
                                    std::span<const std::size_t> free,
                                    std::span<const double> natural) {
  constexpr double kApart = 1e5;  // steps between recordings: no correlation reaches so far
  Eigen::VectorXd residual;
  RowMatrix jacobian;
  if (!function.evaluate(natural, residual, &jacobian)) return std::nullopt;
  NoiseRows rows;
  std::vector<Eigen::Index> kept;
  std::vector<double> half, distances, own_time;
  Eigen::Index row = 0;
  for (const Experiment& experiment : function.experiments()) {
    const Eigen::Index first = std::ssize(kept);
    if (experiment.is_recording) {
      const std::vector<double> steps = half_steps(function, experiment);
      half.insert(half.end(), steps.begin(), steps.end());
    }
    for (const std::size_t i : experiment.data) {
      const FitDatum& d = function.data()[i];
      if (d.held_out) continue;
      if (d.value) {
        if (experiment.is_recording && std::ssize(kept) > first) {
          distances.push_back(d.time_s - own_time.back());
        }
        kept.push_back(row);
        own_time.push_back(d.time_s);
        if (!experiment.is_recording) half.push_back(0.0);
      }
      ++row;
    }
    if (experiment.is_recording) rows.recordings.push_back({first, std::ssize(kept) - first});
  }
  if (std::ranges::any_of(distances, [](double d) { return !(d > 0.0); })) return std::nullopt;
  rows.step_s = median_of(distances);
  for (const Experiment& experiment : function.experiments()) {
    if (!experiment.is_recording) continue;
    rows.at_rest.push_back(measured_at_rest(function, experiment, rows.step_s));
  }
  const Eigen::Index values = std::ssize(kept);
  for (; row < residual.size(); ++row) kept.push_back(row);
  for (const EstimatedParameter& p : function.config().parameters) {
    if (!p.prior) continue;
    const auto place = &p - function.config().parameters.data();
    const Eigen::Index at = kept[static_cast<std::size_t>(values + rows.priors())];
    rows.prior_weight.push_back(jacobian(at, place) * p.prior->sd);
  }
  const std::vector<Eigen::Index> columns(free.begin(), free.end());
  rows.residual = residual(kept);
  rows.jacobian = jacobian(kept, columns);
  rows.half_step = Eigen::VectorXd::Map(half.data(), std::ssize(half));
  // Time goes on within a recording and leaps between what is independent.
  double now = 0.0;
  std::size_t recording = 0;
  for (Eigen::Index i = 0; i < std::ssize(kept); ++i) {
    while (recording < rows.recordings.size() &&
           i >= rows.recordings[recording].first + rows.recordings[recording].count) {
      ++recording;
    }
    const bool within = recording < rows.recordings.size() && i > rows.recordings[recording].first;
    const auto k = static_cast<std::size_t>(i);
    now += within ? own_time[k] - own_time[k - 1] : kApart * rows.step_s;
    rows.time_s.push_back(now);
  }
  return rows;
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

std::string words_of(const NoiseOfEstimates& noise, bool by_drive, Eigen::Index samples) {
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
  if (by_drive) {
    words += fmt::format(
        "{}the noise of the drive, which the law answers, biases estimates; intervals allow for it",
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

  constexpr double kSignificant = 5.41;  // chi-square of one degree, one-sided 1 %
  const bool scale_known = config.scale_known();
  const Correlation raw = correlation_of_rows(*rows, rows->residual);
  const AutoregressionEstimate found = autoregression_of(*rows, scale_known);
  const bool seen = raw.significant || found.gain > kSignificant;
  noise.correlated = seen && (found.phi > 0.0 || raw.inflation() > 1.0);
  noise.phi = noise.correlated ? found.phi : 0.0;
  noise.step_s = rows->step_s;
  const AutoregressiveNoise autoregression(noise.phi, noise.step_s);
  const auto n = static_cast<double>(rows->residual.size());
  const double freedom = n - static_cast<double>(p);
  const double seen_size =
      noise.correlated ? found.variance : rows->residual.squaredNorm() / freedom;
  if (!scale_known && seen_size < computed_variance(function)) return std::nullopt;
  const double square = noise.phi * noise.phi;
  const Eigen::VectorXd off =
      limiting_steps(*rows, seen_size, freedom * (1.0 - square) / (1.0 + square));
  noise.variance = scale_known ? 1.0 : seen_size;
  const bool limited = off.size() > 0 && off.maxCoeff() > 0.0;
  const Eigen::VectorXd bias_of_drive =
      bias_of_drive_noise(function, estimates, parameters, noise.free, natural, seen_size);
  const bool by_drive = bias_of_drive.maxCoeff() > 0.0;
  if (!noise.correlated && !limited && !by_drive) return std::nullopt;

  if (noise.correlated) {
    Eigen::VectorXd white = rows->residual;
    autoregression.whiten(rows->time_s, white);
    const Correlation left = correlation_of_rows(*rows, white);
    noise.beyond = left.significant ? std::max(left.inflation(), 1.0) : 1.0;
  }
  const Eigen::MatrixXd ones = Eigen::VectorXd::Ones(rows->values());
  const double repeats = correlated_columns(autoregression, rows->time_s, ones).sum();
  noise.inflation = std::max(noise.beyond * repeats / static_cast<double>(rows->values()), 1.0);

  const double size = noise.variance * noise.beyond;
  const Eigen::MatrixXd readings = size * estimates.by_readings(noise.phi);
  const Eigen::MatrixXd all =
      readings + estimates.by_priors() + estimates.by_rests(noise.phi, size);
  const Eigen::VectorXd unscaled = estimates.length().cwiseInverse();
  noise.covariance = unscaled.asDiagonal() * all * unscaled.asDiagonal();
  // Derivatives of ln(variance) by phi, and by the size of the noise.
  const double step = 0.02 * (1.0 - noise.phi) + 1e-6;
  const double below = std::max(noise.phi - step, 0.0), above = noise.phi + step;
  const Eigen::VectorXd slope =
      1.0 / (above - below) *
          (size * (estimates.by_readings(above) - estimates.by_readings(below)) +
           estimates.by_rests(above, size) - estimates.by_rests(below, size))
              .diagonal() +
      (scale_known ? 0.0 : found.log_squares_slope) * readings.diagonal();
  const Eigen::VectorXd plain = estimates.plain_variance();
  const Eigen::VectorXd bias = estimates.largest_bias(off) + bias_of_drive;
  noise.of.assign(parameters.size(), {});
  for (Eigen::Index k = 0; k < p; ++k) {
    const double by_phi = noise.correlated ? slope[k] / all(k, k) : 0.0;
    const double share = scale_known ? 0.0 : readings(k, k) / all(k, k);
    const double spread = by_phi * by_phi * found.phi_variance + share * share * 2.0 / freedom;
    constexpr double kMany = 1e6;
    double degrees = spread > 2.0 / kMany ? 2.0 / spread : kMany;
    if (noise.beyond > 1.0) {
      degrees = std::min(degrees, n / noise.inflation - static_cast<double>(p));
    }
    noise.of[noise.free[static_cast<std::size_t>(k)]] = {
        all(k, k) / plain[k], std::max(degrees, 1.0), bias[k] / std::sqrt(plain[k])};
  }
  noise.limited = limited;
  noise.summary = words_of(noise, by_drive, rows->values());
  return noise;
}

}  // namespace tpm::fit
