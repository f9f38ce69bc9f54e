#include "tpm/fit/experiment_residuals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/curve/load.hpp"

namespace tpm {
namespace {

using Kind = ProtocolChoice::Kind;

bool matches_any(const std::vector<Selector>& selectors, const Datum& datum) {
  return std::any_of(selectors.begin(), selectors.end(),
                     [&](const Selector& s) { return s.matches(datum); });
}

std::string condition_of(const Datum& d) {
  std::string text;
  if (d.depth_m) text = fmt::format("{:.6g} mm", *d.depth_m * 1e3);
  if (d.load_N) text = fmt::format("{:.6g} N", *d.load_N);
  if (!d.label.empty()) text += (text.empty() ? "" : ", ") + d.label;
  return text;
}

double required(const std::optional<double>& value, std::string_view what, const std::string& where,
                Kind kind) {
  if (value) return *value;
  throw bad_input(where, fmt::format("the datum has no {}", what),
                  fmt::format("a column of it for protocol '{}'", protocol_kind_name(kind)));
}

/// The imposed value that tells the experiments of a data set apart.
double condition_value(const ProtocolChoice& choice, const Datum& d, const std::string& where) {
  return choice.kind == Kind::creep ? required(d.load_N, "load", where, choice.kind)
                                    : required(d.depth_m, "indentation depth", where, choice.kind);
}

Protocol protocol_for(const ProtocolChoice& choice, double condition, double longest_s) {
  switch (choice.kind) {
    case Kind::ramp_hold:
      return ramp_and_hold(condition, choice.rate_m_per_s, longest_s);
    case Kind::step_hold:
      return step_and_hold(condition, longest_s);
    case Kind::creep:
      return creep(condition, std::numeric_limits<double>::infinity());
    case Kind::static_:
    case Kind::measured:
      break;
  }
  return step_and_hold(condition, std::numeric_limits<double>::infinity());
}

double time_in_protocol(const ProtocolChoice& choice, const Datum& d, double condition,
                        const std::string& where) {
  if (choice.kind == Kind::static_) return std::numeric_limits<double>::infinity();
  const double time = required(d.time_s, "time", where, choice.kind);
  return choice.kind == Kind::ramp_hold ? condition / choice.rate_m_per_s + time : time;
}

void require_observable(const ProtocolChoice& choice, Observable observable,
                        const std::string& where) {
  const bool wants_depth = choice.kind == Kind::creep;
  if (wants_depth == (observable == Observable::indentation_depth)) return;
  throw bad_input(where,
                  fmt::format("protocol '{}' does not give {}", protocol_kind_name(choice.kind),
                              wants_depth ? "a contact force" : "an indentation depth"),
                  wants_depth ? "data of indentation depth under load"
                              : "data of contact force under an imposed depth");
}

std::string data_path(const FitConfig& config, const std::string& dataset) {
  const bool is_file = dataset.ends_with(".csv") || dataset.ends_with(".json");
  if (!is_file || std::filesystem::path(dataset).is_absolute()) return dataset;
  return (config.folder / dataset).string();
}

}  // namespace

ExperimentResiduals::ExperimentResiduals(const FitConfig& config)
    : config_(config), model_(make_model(config.model, {config.tension, 1e-10})) {
  for (std::size_t i = 0; i < config_.data.size(); ++i) {
    if (config_.data[i].protocol.kind == Kind::measured) {
      add_recording(i);
    } else {
      add_points(i, load_points(data_path(config_, config_.data[i].dataset)));
    }
  }
  count_residuals();
}

ExperimentResiduals::ExperimentResiduals(const FitConfig& config, const std::vector<PointSet>& data)
    : config_(config), model_(make_model(config.model, {config.tension, 1e-10})) {
  for (std::size_t i = 0; i < config_.data.size(); ++i) add_points(i, data.at(i));
  count_residuals();
}

void ExperimentResiduals::add_points(std::size_t choice, const PointSet& points) {
  const DataChoice& data = config_.data[choice];
  // One experiment per imposed depth or load, in the order of the file.
  std::map<double, std::vector<const Datum*>> by_condition;
  for (const Datum& d : points.data) {
    if (matches_any(data.exclude, d)) continue;
    const std::string where = fmt::format("data set '{}', line {}", data.dataset, d.line);
    require_observable(data.protocol, points.observable, where);
    by_condition[condition_value(data.protocol, d, where)].push_back(&d);
  }
  for (const auto& [condition, rows] : by_condition) {
    double longest_s = 0.0;
    for (const Datum* d : rows) longest_s = std::max(longest_s, d->time_s.value_or(0.0));
    Experiment experiment{protocol_for(data.protocol, condition, longest_s), {}, {}, choice};
    for (const Datum* d : rows) {
      const std::string where = fmt::format("data set '{}', line {}", data.dataset, d->line);
      FitDatum datum;
      datum.dataset = data.dataset;
      datum.label = condition_of(*d);
      datum.observable = points.observable;
      datum.time_s = time_in_protocol(data.protocol, *d, condition, where);
      datum.value = d->value;
      datum.lower = d->lower;
      datum.upper = d->upper;
      const double size = d->value ? *d->value : 0.5 * (*d->lower + *d->upper);
      datum.sigma = sigma_of(data.noise, size, d->sd, where);
      if (!d->value && data.noise.kind != NoiseKind::absolute &&
          data.noise.kind != NoiseKind::per_row) {
        // A band's tail is relative to the band's middle whatever the convention for values.
        datum.sigma = data.noise.absolute + data.noise.relative * size;
      }
      datum.provenance = d->provenance;
      datum.held_out = matches_any(data.hold_out, *d);
      experiment.times_s.push_back(datum.time_s);
      experiment.data.push_back(data_.size());
      data_.push_back(std::move(datum));
    }
    experiments_.push_back(std::move(experiment));
  }
}

void ExperimentResiduals::add_recording(std::size_t choice) {
  const DataChoice& data = config_.data[choice];
  const Recording recording = load_recording(data_path(config_, data.dataset));
  const std::vector<double>& force = recording.force_N();
  const std::vector<double>& sd = recording.force_sd_N();
  Experiment experiment{
      measured_history(Drive::displacement, recording.time_s, recording.depth_m()), {}, {}, choice};
  for (std::size_t i = 0; i < force.size(); ++i) {
    FitDatum datum;
    datum.dataset = data.dataset;
    datum.label = fmt::format("t = {:.6g} s", recording.time_s[i]);
    datum.time_s = recording.time_s[i];
    datum.value = force[i];
    datum.sigma =
        sigma_of(data.noise, force[i], sd.empty() ? std::nullopt : std::optional<double>(sd[i]),
                 fmt::format("recording '{}', sample {}", data.dataset, i + 1));
    datum.provenance = recording.provenance;
    experiment.times_s.push_back(datum.time_s);
    experiment.data.push_back(data_.size());
    data_.push_back(std::move(datum));
  }
  experiments_.push_back(std::move(experiment));
}

void ExperimentResiduals::count_residuals() {
  residual_count_ = 0;
  offset_ = 0.0;
  for (const Experiment& experiment : experiments_) {
    for (const std::size_t i : experiment.data) {
      if (data_[i].held_out) continue;
      ++residual_count_;
      if (data_[i].value && noise(experiment.choice).kind == NoiseKind::relative_to_model) {
        ++residual_count_;
        offset_ += kNormalisationOffset;
      }
    }
  }
  if (residual_count_ == 0) {
    throw bad_input("fit", "no datum is left to fit", "at least one that is not excluded");
  }
}

int ExperimentResiduals::value_count() const {
  return static_cast<int>(std::count_if(data_.begin(), data_.end(), [](const FitDatum& d) {
    return d.value.has_value() && !d.held_out;
  }));
}

int ExperimentResiduals::band_count() const {
  return static_cast<int>(std::count_if(data_.begin(), data_.end(), [](const FitDatum& d) {
    return !d.value.has_value() && !d.held_out;
  }));
}

TpmVector ExperimentResiduals::model_parameters(std::span<const double> natural) const {
  TpmVector values = to_vector(config_.fixed);
  for (std::size_t i = 0; i < config_.parameters.size(); ++i) {
    for (const TpmIndex target : config_.parameters[i].sets) {
      values[static_cast<std::size_t>(target)] = natural[i];
    }
  }
  return values;
}

Eigen::VectorXd ExperimentResiduals::predict(std::span<const double> natural,
                                             RowMatrix* sensitivity) const {
  const TpmVector values = model_parameters(natural);
  const Want want = sensitivity != nullptr ? Want::values_and_sensitivity : Want::values;
  Eigen::VectorXd answer(static_cast<Eigen::Index>(data_.size()));
  if (sensitivity != nullptr) {
    sensitivity->setZero(answer.size(), static_cast<Eigen::Index>(config_.parameters.size()));
  }
  for (const Experiment& experiment : experiments_) {
    const Response response =
        model_->respond(experiment.protocol, experiment.times_s, values, want);
    for (std::size_t k = 0; k < experiment.data.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(experiment.data[k]);
      const auto from = static_cast<Eigen::Index>(k);
      answer[row] = response.value[from];
      if (sensitivity == nullptr) continue;
      for (std::size_t j = 0; j < config_.parameters.size(); ++j) {
        for (const TpmIndex target : config_.parameters[j].sets) {
          (*sensitivity)(row, static_cast<Eigen::Index>(j)) += response.sensitivity(from, target);
        }
      }
    }
  }
  return answer;
}

bool ExperimentResiduals::evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                                   RowMatrix* jacobian) const {
  RowMatrix sensitivity;
  Eigen::VectorXd answer;
  try {
    answer = predict(natural, jacobian != nullptr ? &sensitivity : nullptr);
  } catch (const Error& error) {
    // A solver that gives up at some trial parameters is for the optimiser to back away from; bad
    // input is not.
    if (error.code() != ExitCode::numerical) throw;
    return false;
  }
  residual.resize(residual_count_);
  if (jacobian != nullptr) jacobian->resize(residual_count_, sensitivity.cols());
  Eigen::Index row = 0;
  const auto put = [&](double r, double d_r, Eigen::Index datum) {
    residual[row] = r;
    if (jacobian != nullptr) jacobian->row(row) = d_r * sensitivity.row(datum);
    ++row;
  };
  for (const Experiment& experiment : experiments_) {
    for (const std::size_t i : experiment.data) {
      const FitDatum& d = data_[i];
      if (d.held_out) continue;
      const auto index = static_cast<Eigen::Index>(i);
      if (!d.value) {
        const DatumResidual r = band_residual(d.sigma, *d.lower, *d.upper, answer[index]);
        put(r.r, r.d_r, index);
        continue;
      }
      auto r = value_residual(noise(experiment.choice), d.sigma, *d.value, answer[index]);
      if (!r) return false;
      apply_loss(config_.loss, *r);
      put(r->r, r->d_r, index);
      if (noise(experiment.choice).kind == NoiseKind::relative_to_model) {
        put(r->normalisation, r->d_normalisation, index);
      }
    }
  }
  return residual.allFinite();
}

void ExperimentResiduals::set_value(std::size_t datum, double value) {
  FitDatum& d = data_.at(datum);
  for (const Experiment& experiment : experiments_) {
    if (std::find(experiment.data.begin(), experiment.data.end(), datum) == experiment.data.end()) {
      continue;
    }
    d.sigma = sigma_of(noise(experiment.choice), value, d.sigma, "simulated datum");
  }
  d.value = value;
}

}  // namespace tpm
