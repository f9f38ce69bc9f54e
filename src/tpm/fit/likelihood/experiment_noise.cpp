// Declared in tpm/fit/likelihood/experiment_residuals.hpp.
// The noise of ExperimentResiduals.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

std::optional<std::size_t> ExperimentResiduals::parameter_place(const std::string& name) const {
  for (std::size_t i = 0; i < config_.parameters.size() && !name.empty(); ++i) {
    if (config_.parameters[i].fit.name == name) return i;
  }
  return std::nullopt;
}

double ExperimentResiduals::MovingSigma::value_a(std::span<const double> natural) const {
  return a ? natural[*a] : sigma.fixed_a.value_or(0.0);
}

double ExperimentResiduals::MovingSigma::value_b(std::span<const double> natural) const {
  return b ? natural[*b] : sigma.fixed_b.value_or(0.0);
}

bool ExperimentResiduals::has_normalisation(std::size_t choice) const {
  return moving_sigma_[choice] || noise(choice).kind == NoiseKind::relative_to_model;
}

void ExperimentResiduals::resolve_noise_parameters() {
  moving_sigma_.assign(config_.data.size(), std::nullopt);
  for (std::size_t i = 0; i < config_.data.size(); ++i) {
    const DataChoice& data = config_.data[i];
    const bool shaped_model =
        data.noise.kind == NoiseKind::relative_to_model && data.noise.shape != ErrorShape::normal;
    if (!data.estimates_sigma() && !shaped_model) continue;
    MovingSigma moving;
    if (data.noise.kind == NoiseKind::log) {
      // On the logarithm's scale the one standard deviation is a, whatever its name.
      moving.sigma = {std::nullopt, 0.0, 1.0};
      moving.a = parameter_place(data.sigma_b);
    } else {
      moving.a = parameter_place(data.sigma_a);
      moving.b = parameter_place(data.sigma_b);
      const bool has_a = uses_absolute(data.noise.kind);
      const bool has_b = uses_relative(data.noise.kind);
      if (!moving.a) moving.sigma.fixed_a = has_a ? data.noise.absolute : 0.0;
      if (!moving.b) moving.sigma.fixed_b = has_b ? data.noise.relative : 0.0;
      moving.sigma.reference = data_size(i);
    }
    moving_sigma_[i] = moving;
  }
  for (EstimatedParameter& parameter : config_.parameters) {
    if (parameter.from_data) resolve_noise_parameter(parameter);
  }
}

double ExperimentResiduals::data_size(std::size_t choice) const {
  double size = 0.0;
  for (const FitDatum& d : data_) {
    if (d.choice == choice && d.value && !d.held_out) size = std::max(size, std::abs(*d.value));
  }
  if (size > 0.0) return size;
  throw bad_input(fmt::format("data set '{}'", config_.data[choice].dataset),
                  "no value other than 0, and the noise follows from their size",
                  "a noise of kind 'absolute' with a stated standard deviation");
}

void ExperimentResiduals::resolve_noise_parameter(EstimatedParameter& parameter) {
  FitParameter& fit = parameter.fit;
  double size = 1.0;  // of a relative or logarithmic standard deviation
  if (fit.unit.dimension != Dimension::dimensionless) {
    size = 0.0;
    for (std::size_t i = 0; i < config_.data.size(); ++i) {
      if (config_.data[i].sigma_a == fit.name) size = std::max(size, data_size(i));
    }
  }
  // From what a machine's rounding leaves to noise that drowns the data.
  fit.start = 0.05 * size;
  fit.lower = 1e-6 * size;
  fit.upper = 10.0 * size;
}

bool ExperimentResiduals::information_root(std::span<const double> natural, RowMatrix& root) const {
  if (!is_normal_of_stated_size()) return expected_information_root(natural, root);
  return ResidualFunction::information_root(natural, root);
}

bool ExperimentResiduals::is_normal_of_stated_size() const {
  for (std::size_t i = 0; i < config_.data.size(); ++i) {
    if (moving_sigma_[i] || noise(i).shape != ErrorShape::normal) return false;
  }
  return true;
}

bool ExperimentResiduals::expected_information_root(std::span<const double> natural,
                                                    RowMatrix& root) const {
  Eigen::VectorXd residual;
  if (!evaluate(natural, residual, &root)) return false;
  RowMatrix sensitivity;
  const Eigen::VectorXd answer = predict(natural, &sensitivity);
  // The residuals' Jacobian is right for normal noise of stated size and for bands; the rows of the
  // other values are replaced.
  Eigen::Index row = 0;
  for (const Experiment& experiment : experiments_) {
    const ErrorLaw law = error_law(noise(experiment.choice));
    const auto& moving = moving_sigma_[experiment.choice];
    for (const std::size_t i : experiment.data) {
      const FitDatum& d = data_[i];
      if (d.held_out) continue;
      const auto index = static_cast<Eigen::Index>(i);
      if (d.value && moving) {
        const auto terms = noise_information(law, moving->sigma, answer[index],
                                             moving->value_a(natural), moving->value_b(natural));
        if (!terms) return false;
        write_row(terms->residual, *moving, weight(i), sensitivity.row(index), root.row(row));
        write_row(terms->normalisation, *moving, weight(i), sensitivity.row(index),
                  root.row(row + 1));
      } else if (d.value && law.shape != ErrorShape::normal) {
        const double slope = transformed_slope(law.scale, answer[index]) / d.sigma;
        root.row(row) =
            weight(i) * std::sqrt(location_information(law)) * slope * sensitivity.row(index);
      }
      row += d.value && has_normalisation(experiment.choice) ? 2 : 1;
    }
  }
  return true;
}

bool ExperimentResiduals::has_censored() const {
  return std::ranges::any_of(data_, [](const FitDatum& d) { return d.at_limit.has_value(); });
}

void ExperimentResiduals::set_noise_scale(double scale) {
  if (!(scale > 0.0)) throw std::logic_error("a size of noise that is not above 0");
  noise_scale_ = scale;
  find_linear();
  if (surrogate_) surrogate_->set_noise_scale(scale);
}

double ExperimentResiduals::noise_scale(std::size_t datum, double answer,
                                        std::span<const double> natural) const {
  const FitDatum& d = data_.at(datum);
  if (const auto& moving = moving_sigma_[d.choice]) {
    return moving->value_a(natural) + moving->value_b(natural) * std::abs(answer);
  }
  return noise(d.choice).kind == NoiseKind::relative_to_model ? d.sigma * std::abs(answer)
                                                              : d.sigma;
}

double ExperimentResiduals::new_noise_scale(std::size_t datum, double answer,
                                            std::span<const double> natural) const {
  const Noise& n = noise(data_.at(datum).choice);
  if (moving_sigma_[data_[datum].choice]) return noise_scale(datum, answer, natural);
  switch (n.kind) {
    case NoiseKind::absolute:
      return n.absolute;
    case NoiseKind::log:
      return n.relative;
    case NoiseKind::relative_to_datum:
    case NoiseKind::combined:
    case NoiseKind::relative_to_model:
      return (uses_absolute(n.kind) ? n.absolute : 0.0) + n.relative * std::abs(answer);
    case NoiseKind::per_row:
      break;
  }
  return data_[datum].sigma;
}

double ExperimentResiduals::standardised(std::size_t datum, double answer,
                                         std::span<const double> natural) const {
  const FitDatum& d = data_.at(datum);
  if (!d.value) return band_residual(d.sigma, *d.lower, *d.upper, answer).r;
  const ErrorScale scale = error_law(noise(d.choice)).scale;
  if (moving_sigma_[d.choice]) {
    const double sigma = noise_scale(datum, answer, natural);
    const bool possible = scale == ErrorScale::linear || answer > 0.0;
    return possible ? (transformed(scale, answer) - transformed(scale, *d.value)) / sigma
                    : std::numeric_limits<double>::infinity();
  }
  const auto r = value_residual(noise(d.choice), d.sigma, *d.value, answer);
  return r ? r->r : std::numeric_limits<double>::infinity();
}

void ExperimentResiduals::set_value(std::size_t datum, double value) {
  if (surrogate_) surrogate_->set_value(datum, value);
  FitDatum& d = data_.at(datum);
  if (!noise(d.choice).angle_rad) {
    d.sigma = value_sigma(config_.data[d.choice], value, d.sigma, "simulated datum");
  }
  d.value = value;
  set_plain_value(datum);
}

}  // namespace tpm::fit
