#include "tpm/fit/likelihood/experiment_residuals.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/fit/likelihood/delayed_rise.hpp"
#include "tpm/work/interrupted.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

ExperimentResiduals::ExperimentResiduals(const FitConfig& config)
    : ExperimentResiduals(config, load_data(config)) {}

ExperimentResiduals::ExperimentResiduals(const FitConfig& config, const std::vector<DataSet>& data)
    : config_(config), model_(make_model(config)), order_(config) {
  ExperimentSet set = set_up_experiments(config_, data);
  data_ = std::move(set.data);
  experiments_ = std::move(set.experiments);
  resolve_noise_parameters();
  count_residuals();
  find_drifts();
  find_linear();
  set_up_surrogate();
}

void ExperimentResiduals::set_up_surrogate() {
  std::shared_ptr<const Model> surrogate = model_->surrogate();
  if (!surrogate) return;
  surrogate_ = copy();
  surrogate_->model_ = std::move(surrogate);
  surrogate_->find_linear();
}

void ExperimentResiduals::find_linear() {
  const bool noise_stays = config_.loss.kind == Loss::none && !(noise_scale_ && has_censored()) &&
                           std::ranges::all_of(config_.data, [](const DataChoice& d) {
                             return d.noise.kind != NoiseKind::log &&
                                    d.noise.kind != NoiseKind::relative_to_model &&
                                    d.noise.shape == ErrorShape::normal && !d.estimates_sigma();
                           });
  // A depth in response to a load is linear in a compliance, not in a stiffness.
  const bool by_load = std::ranges::any_of(experiments_, [](const Experiment& e) {
    const auto* course = std::get_if<TimeCourse>(&e.imposed);
    return course != nullptr && course->protocol.drive() == Drive::force;
  });
  linear_.clear();
  linear_.reserve(config_.parameters.size());
  for (const EstimatedParameter& p : config_.parameters) {
    linear_.push_back(noise_stays && !by_load && p.fit.scale == Scale::linear &&
                      (p.drift || !p.sets.empty()) &&
                      std::all_of(p.sets.begin(), p.sets.end(), [&](const Target& target) {
                        return model_->linear_in(target.parameter);
                      }));
  }
}

void ExperimentResiduals::leave_out_held_out() {
  fitted_.clear();
  const bool any = std::ranges::any_of(data_, [](const auto& d) { return d.held_out; });
  if (!any) return;
  fitted_ = experiments_;
  for (Experiment& experiment : fitted_) {
    auto* course = std::get_if<TimeCourse>(&experiment.imposed);
    if (course == nullptr) continue;  // an oscillation is answered at once
    std::vector<double> times_s;
    std::vector<std::size_t> data;
    for (std::size_t k = 0; k < experiment.data.size(); ++k) {
      if (data_[experiment.data[k]].held_out) continue;
      times_s.push_back(course->times_s[k]);
      data.push_back(experiment.data[k]);
    }
    course->times_s = std::move(times_s);
    experiment.data = std::move(data);
  }
}

void ExperimentResiduals::count_residuals() {
  residual_count_ = 0;
  offset_ = 0.0;
  leave_out_held_out();
  for (const Experiment& experiment : experiments_) {
    for (const std::size_t i : experiment.data) {
      if (data_[i].held_out) continue;
      ++residual_count_;
      if (data_[i].value && has_normalisation(experiment.choice)) {
        ++residual_count_;
        offset_ += weight(i) * weight(i) * kNormalisationOffset;
      }
    }
  }
  if (residual_count_ == 0) {
    throw bad_input("fit", "no datum is left to fit", "at least one that is not excluded");
  }
  residual_count_ += prior_count(config_);
  set_up_plain();
}

bool ExperimentResiduals::is_plain() const {
  if (config_.loss.kind != Loss::none || !is_normal_of_stated_size()) return false;
  for (std::size_t i = 0; i < config_.data.size(); ++i) {
    if (noise(i).kind == NoiseKind::log || has_normalisation(i)) return false;
  }
  return std::all_of(data_.begin(), data_.end(),
                     [](const FitDatum& d) { return d.held_out || d.value.has_value(); });
}

void ExperimentResiduals::set_up_plain() {
  plain_.reset();
  if (!is_plain()) return;
  plain_ = {Eigen::VectorXd(residual_count_), Eigen::VectorXd(residual_count_),
            std::vector<Eigen::Index>(data_.size(), -1)};
  Eigen::Index row = 0;
  for (const Experiment& experiment : fitted()) {
    for (const std::size_t i : experiment.data) {
      if (data_[i].held_out) continue;
      plain_->row[i] = row++;
      set_plain_value(i);
    }
  }
}

void ExperimentResiduals::set_plain_value(std::size_t datum) {
  const Eigen::Index row = plain_ ? plain_->row[datum] : -1;
  if (row < 0) return;
  plain_->observed[row] = *data_[datum].value;
  plain_->factor[row] = weight(datum) / data_[datum].sigma;
}

void ExperimentResiduals::evaluate_plain(std::span<const double> natural, Eigen::VectorXd& residual,
                                         RowMatrix* jacobian) const {
  const Want want = jacobian != nullptr ? Want::values_and_sensitivity : Want::values;
  residual.resize(residual_count_);
  if (jacobian != nullptr) jacobian->setZero(residual_count_, std::ssize(config_.parameters));
  for (const Experiment& experiment : fitted()) {
    const Response response = respond_to(experiment, natural, want);
    const auto columns = columns_for(experiment.choice);
    std::vector<Eigen::Index> rows;
    for (const std::size_t datum : experiment.data) rows.push_back(plain_->row[datum]);
    for (std::size_t k = 0; k < experiment.data.size(); ++k) {
      const Eigen::Index row = plain_->row[experiment.data[k]];
      if (row < 0) continue;
      const auto from = static_cast<Eigen::Index>(k);
      const double factor = plain_->factor[row];
      residual[row] = factor * (response.value[from] - plain_->observed[row]);
      if (jacobian == nullptr) continue;
      for (const auto& [source, target] : columns) {
        (*jacobian)(row, target) += factor * response.sensitivity(from, source);
      }
    }
    add_drifts(experiment, natural, rows, &plain_->factor, residual, jacobian);
    if (jacobian != nullptr) {
      add_rise_slopes(experiment, natural, response, rows, &plain_->factor, *jacobian);
    }
    decorrelate(experiment, residual, jacobian);
  }
  put_priors(natural, residual, jacobian);
}

void ExperimentResiduals::decorrelate(const Experiment& experiment, Eigen::VectorXd& residual,
                                      RowMatrix* jacobian) const {
  for (std::size_t k = 1; k < experiment.data.size(); ++k) {
    const std::size_t datum = experiment.data[k], before = experiment.data[k - 1];
    const double c = data_[datum].correlation;
    const Eigen::Index row = plain_->row[datum], other = plain_->row[before];
    // Readings that a resampled set counts unequally are taken for independent.
    if (c == 0.0 || row < 0 || other < 0 || weight(datum) != weight(before)) continue;
    const double left = 1.0 / std::sqrt(1.0 - c * c);
    residual[row] = left * (residual[row] - c * residual[other]);
    if (jacobian != nullptr) {
      jacobian->row(row) = left * (jacobian->row(row) - c * jacobian->row(other));
    }
  }
}

int ExperimentResiduals::value_count() const {
  return static_cast<int>(std::ranges::count_if(
      data_, [](const FitDatum& d) { return d.value.has_value() && !d.held_out; }));
}

int ExperimentResiduals::band_count() const {
  return static_cast<int>(std::ranges::count_if(
      data_, [](const FitDatum& d) { return !d.value.has_value() && !d.held_out; }));
}

Response ExperimentResiduals::respond_to(const Experiment& experiment,
                                         std::span<const double> natural, Want want) const {
  const std::vector<double> parameters = model_parameters(config_, natural, experiment.choice);
  if (const auto* oscillation = std::get_if<Oscillation>(&experiment.imposed)) {
    return respond(*oscillation, parameters, want);
  }
  const auto& course = std::get<TimeCourse>(experiment.imposed);
  if (asks_along() && want == Want::values_and_sensitivity) {
    return model_->respond_along(course.driven(), course.times_s, parameters,
                                 changes_for(experiment.choice));
  }
  const std::vector<DelayedRise> rises = rises_of(experiment, natural);
  if (rises.empty()) return model_->respond(course.driven(), course.times_s, parameters, want);
  return model_->respond(with_delays(course.driven(), rises), course.times_s, parameters, want);
}

Eigen::VectorXd ExperimentResiduals::predict(std::span<const double> natural,
                                             RowMatrix* sensitivity) const {
  return answers(experiments_, natural, sensitivity);
}

Eigen::VectorXd ExperimentResiduals::answers(const std::vector<Experiment>& experiments,
                                             std::span<const double> natural,
                                             RowMatrix* sensitivity) const {
  const Want want = sensitivity != nullptr ? Want::values_and_sensitivity : Want::values;
  Eigen::VectorXd answer(static_cast<Eigen::Index>(data_.size()));
  if (sensitivity != nullptr) {
    sensitivity->setZero(answer.size(), static_cast<Eigen::Index>(config_.parameters.size()));
  }
  for (const Experiment& experiment : experiments) {
    const Response response = respond_to(experiment, natural, want);
    const auto from_to = columns_for(experiment.choice);
    for (std::size_t k = 0; k < experiment.data.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(experiment.data[k]);
      const auto from = static_cast<Eigen::Index>(k);
      answer[row] = response.value[from];
      if (sensitivity == nullptr) continue;
      for (const auto& [source, target] : from_to) {
        (*sensitivity)(row, target) += response.sensitivity(from, source);
      }
    }
    const std::vector<Eigen::Index> rows(experiment.data.begin(), experiment.data.end());
    add_drifts(experiment, natural, rows, nullptr, answer, sensitivity);
    if (sensitivity != nullptr) {
      add_rise_slopes(experiment, natural, response, rows, nullptr, *sensitivity);
    }
  }
  return answer;
}

Eigen::MatrixXd ExperimentResiduals::changes_for(std::size_t choice) const {
  Eigen::MatrixXd changes =
      Eigen::MatrixXd::Zero(std::ssize(model_->parameters()), std::ssize(config_.parameters));
  for (Eigen::Index j = 0; j < changes.cols(); ++j) {
    for (const Target& target : config_.parameters[static_cast<std::size_t>(j)].sets) {
      if (!target.applies_to(choice)) continue;
      changes(static_cast<Eigen::Index>(target.parameter), j) = 1.0;
    }
  }
  return changes;
}

std::vector<std::pair<Eigen::Index, Eigen::Index>> ExperimentResiduals::columns_for(
    std::size_t choice) const {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> columns;
  if (asks_along()) {
    for (Eigen::Index j = 0; j < std::ssize(config_.parameters); ++j) columns.emplace_back(j, j);
    return columns;
  }
  for (std::size_t j = 0; j < config_.parameters.size(); ++j) {
    for (const Target& target : config_.parameters[j].sets) {
      if (!target.applies_to(choice)) continue;
      columns.emplace_back(static_cast<Eigen::Index>(target.parameter),
                           static_cast<Eigen::Index>(j));
    }
  }
  return columns;
}

bool ExperimentResiduals::evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                                   RowMatrix* jacobian) const {
  if (config_.interrupted && config_.interrupted()) {
    throw Interrupted("fit: interrupted; nothing was written");
  }
  RowMatrix sensitivity;
  Eigen::VectorXd answer;
  try {
    if (plain_) {
      evaluate_plain(natural, residual, jacobian);
      return residual.allFinite();
    }
    answer = answers(fitted(), natural, jacobian != nullptr ? &sensitivity : nullptr);
  } catch (const Error& error) {
    // A solver that gives up at some trial parameters is for the optimiser to back away from; bad
    // input is not.
    if (error.code() != ExitCode::numerical) throw;
    return false;
  }
  residual.resize(residual_count_);
  if (jacobian != nullptr) jacobian->resize(residual_count_, sensitivity.cols());
  Eigen::Index row = 0;
  double w = 1.0;
  const auto put = [&](double r, double d_r, Eigen::Index datum) {
    residual[row] = w * r;
    if (jacobian != nullptr) jacobian->row(row) = w * d_r * sensitivity.row(datum);
    ++row;
  };
  const auto put_term = [&](const NoiseTerm& term, const MovingSigma& moving, Eigen::Index datum) {
    residual[row] = w * term.value;
    if (jacobian != nullptr) {
      write_row(term, moving, w, sensitivity.row(datum), jacobian->row(row));
    }
    ++row;
  };
  for (const Experiment& experiment : experiments_) {
    for (const std::size_t i : experiment.data) {
      const FitDatum& d = data_[i];
      if (d.held_out) continue;
      const auto index = static_cast<Eigen::Index>(i);
      w = weight(i);
      if (!d.value) {
        DatumResidual r;
        if (!d.at_limit) {
          r = band_residual(d.sigma, *d.lower, *d.upper, answer[index]);
        } else if (noise_scale_) {
          r = censored_residual(d.sigma, *noise_scale_, *d.lower, *d.upper, answer[index]);
        }
        put(r.r, r.d_r, index);
        continue;
      }
      const Noise& law = noise(experiment.choice);
      if (const auto& moving = moving_sigma_[experiment.choice]) {
        const auto terms = noise_residual(error_law(law), moving->sigma, *d.value, answer[index],
                                          moving->value_a(natural), moving->value_b(natural));
        if (!terms) return false;
        put_term(terms->residual, *moving, index);
        put_term(terms->normalisation, *moving, index);
        continue;
      }
      auto r = value_residual(law, d.sigma, *d.value, answer[index]);
      if (!r) return false;
      apply_shape(error_law(law), *r);
      apply_loss(config_.loss, *r);
      put(r->r, r->d_r, index);
      if (law.kind == NoiseKind::relative_to_model) {
        put(r->normalisation, r->d_normalisation, index);
      }
    }
  }
  put_priors(natural, residual, jacobian);
  return residual.allFinite();
}

void ExperimentResiduals::write_row(const NoiseTerm& term, const MovingSigma& moving, double factor,
                                    const Eigen::Ref<const Eigen::RowVectorXd>& sensitivity,
                                    Eigen::Ref<Eigen::RowVectorXd> row) {
  row = factor * term.by_f * sensitivity;
  if (moving.a) row[static_cast<Eigen::Index>(*moving.a)] += factor * term.by_a;
  if (moving.b) row[static_cast<Eigen::Index>(*moving.b)] += factor * term.by_b;
}

double ExperimentResiduals::weight(std::size_t datum) const {
  return counts_.empty() ? 1.0 : std::sqrt(static_cast<double>(counts_[datum]));
}

void ExperimentResiduals::set_counts(std::vector<int> counts) {
  if (surrogate_) surrogate_->set_counts(counts);
  counts_ = std::move(counts);
  count_residuals();
}

void ExperimentResiduals::leave_out(std::span<const std::size_t> outliers) {
  if (surrogate_) surrogate_->leave_out(outliers);
  for (const std::size_t i : outliers) data_.at(i).held_out = data_[i].outlier = true;
  count_residuals();
}

namespace {

/// A course with every so manieth of its knots and samples, and the last.
void thin(Experiment& experiment, std::size_t stride) {
  auto& course = std::get<TimeCourse>(experiment.imposed);
  const std::size_t n = experiment.data.size();
  std::vector<Knot> knots;
  std::vector<double> times_s;
  std::vector<std::size_t> data;
  for (std::size_t i = 0; i < n; ++i) {
    if (i % stride != 0 && i + 1 != n) continue;
    knots.push_back(course.protocol.knots()[i]);
    times_s.push_back(course.times_s[i]);
    data.push_back(experiment.data[i]);
  }
  Protocol protocol(course.protocol.drive(), std::move(knots), course.protocol.name());
  protocol.set_equilibrium_at_start(course.protocol.equilibrium_at_start());
  course.protocol = std::move(protocol);
  course.times_s = std::move(times_s);
  experiment.data = std::move(data);
}

}  // namespace

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::thinned(std::size_t most) const {
  // Not a copy(): of a million data only the few that are kept are taken along.
  std::unique_ptr<ExperimentResiduals> few(new ExperimentResiduals());
  few->config_ = config_;
  few->model_ = model_;
  few->moving_sigma_ = moving_sigma_;
  few->linear_ = linear_;
  few->order_ = order_;
  few->drifts_ = drifts_;
  few->rises_ = rises_;
  few->prior_weight_ = prior_weight_;
  few->noise_scale_ = noise_scale_;
  for (Experiment experiment : experiments_) {
    const std::size_t n = experiment.data.size();
    if (experiment.is_recording && n > most) thin(experiment, (n + most - 1) / most);
    for (std::size_t& datum : experiment.data) {
      if (!counts_.empty()) few->counts_.push_back(counts_[datum]);
      few->data_.push_back(data_[datum]);
      datum = few->data_.size() - 1;
    }
    few->experiments_.push_back(std::move(experiment));
  }
  few->count_residuals();
  return few;
}

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::copy() const {
  // make_unique cannot reach the private constructor.
  std::unique_ptr<ExperimentResiduals> other(new ExperimentResiduals());
  other->config_ = config_;
  other->model_ = model_;
  other->data_ = data_;
  other->experiments_ = experiments_;
  other->fitted_ = fitted_;
  other->moving_sigma_ = moving_sigma_;
  other->counts_ = counts_;
  other->linear_ = linear_;
  other->order_ = order_;
  other->drifts_ = drifts_;
  other->rises_ = rises_;
  other->prior_weight_ = prior_weight_;
  other->noise_scale_ = noise_scale_;
  other->plain_ = plain_;
  other->residual_count_ = residual_count_;
  other->offset_ = offset_;
  if (surrogate_) other->surrogate_ = surrogate_->copy();
  return other;
}

}  // namespace tpm::fit
