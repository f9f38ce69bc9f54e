// Declared in tpm/fit/likelihood/experiment_residuals.hpp.
// Terms of ExperimentResiduals beside readings: priors, drifts of the zero, and rises.
#include <stdexcept>

#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {

void ExperimentResiduals::set_prior_weight(double weight) {
  if (!(weight > 0.0)) throw std::logic_error("a weight of priors that is not above 0");
  prior_weight_ = weight;
  if (surrogate_) surrogate_->set_prior_weight(weight);
}

void ExperimentResiduals::find_drifts() {
  drifts_.clear();
  rises_.clear();
  for (std::size_t j = 0; j < config_.parameters.size(); ++j) {
    if (config_.parameters[j].drift) drifts_.push_back(j);
    if (config_.parameters[j].rise) rises_.push_back(j);
  }
}

void ExperimentResiduals::add_drifts(const Experiment& experiment, std::span<const double> natural,
                                     std::span<const Eigen::Index> place,
                                     const Eigen::VectorXd* factor, Eigen::VectorXd& value,
                                     RowMatrix* slopes) const {
  for (const std::size_t j : drifts_) {
    const DriftTerm& drift = *config_.parameters[j].drift;
    if (drift.choice != experiment.choice) continue;
    for (std::size_t k = 0; k < experiment.data.size(); ++k) {
      const Eigen::Index row = place[k];
      if (row < 0) continue;
      const double since_s = data_[experiment.data[k]].time_s - drift.origin_s;
      const double slope = since_s * (factor != nullptr ? (*factor)[row] : 1.0);
      value[row] += natural[j] * slope;
      if (slopes != nullptr) (*slopes)(row, static_cast<Eigen::Index>(j)) += slope;
    }
  }
}

std::vector<DelayedRise> ExperimentResiduals::rises_of(const Experiment& experiment,
                                                       std::span<const double> natural) const {
  std::vector<DelayedRise> rises;
  for (const std::size_t j : rises_) {
    const RiseTerm& rise = *config_.parameters[j].rise;
    if (rise.choice != experiment.choice) continue;
    rises.push_back({rise.begin_s, rise.end_s, natural[j]});
  }
  return rises;
}

void ExperimentResiduals::add_rise_slopes(const Experiment& experiment,
                                          std::span<const double> natural, const Response& response,
                                          std::span<const Eigen::Index> place,
                                          const Eigen::VectorXd* factor, RowMatrix& slopes) const {
  constexpr double kStep = 1e-5;  // of the bounds, away from the kink at 0 and from the bounds
  for (const std::size_t j : rises_) {
    if (config_.parameters[j].rise->choice != experiment.choice) continue;
    const FitParameter& p = config_.parameters[j].fit;
    const bool up = natural[j] >= 0.0 ? natural[j] < 0.5 * p.upper : natural[j] < 0.5 * p.lower;
    const double step = (up ? kStep : -kStep) * (p.upper - p.lower);
    std::vector<double> moved(natural.begin(), natural.end());
    moved[j] += step;
    const Response then = respond_to(experiment, moved, Want::values);
    for (std::size_t k = 0; k < experiment.data.size(); ++k) {
      const Eigen::Index row = place[k];
      if (row < 0) continue;
      const auto from = static_cast<Eigen::Index>(k);
      const double by = (then.value[from] - response.value[from]) / step;
      slopes(row, static_cast<Eigen::Index>(j)) += by * (factor != nullptr ? (*factor)[row] : 1.0);
    }
  }
}

void ExperimentResiduals::put_priors(std::span<const double> natural, Eigen::VectorXd& residual,
                                     RowMatrix* jacobian) const {
  Eigen::Index row = residual.size() - prior_count(config_);
  for (std::size_t j = 0; j < config_.parameters.size(); ++j) {
    const std::optional<Prior>& prior = config_.parameters[j].prior;
    if (!prior) continue;
    residual[row] = prior_weight_ * (natural[j] - prior->mean) / prior->sd;
    if (jacobian != nullptr) {
      jacobian->row(row).setZero();
      (*jacobian)(row, static_cast<Eigen::Index>(j)) = prior_weight_ / prior->sd;
    }
    ++row;
  }
}

}  // namespace tpm::fit
