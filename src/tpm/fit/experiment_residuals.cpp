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

/// A recording's drive must be the one that the model takes.
void require_drive(const FitConfig& config, const Recording& recording, const std::string& name) {
  const LawSpec spec = config.law.value_or(LawSpec{});
  const bool has_drive = recording.drive.size() == recording.response.size() &&
                         recording.time_s.size() == recording.response.size();
  if (has_drive && recording.drive_quantity == spec.drive &&
      recording.response_quantity == spec.response) {
    return;
  }
  throw bad_input(fmt::format("recording '{}'", name),
                  has_drive ? fmt::format("{} over {}", quantity_name(recording.response_quantity),
                                          quantity_name(recording.drive_quantity))
                            : std::string("no times or no drive"),
                  fmt::format("{} over {}, with times", quantity_name(spec.response),
                              quantity_name(spec.drive)));
}

double sample_sigma(const DataChoice& data, double value, std::optional<double> row_sd,
                    std::size_t sample) {
  if (data.noise.kind == NoiseKind::absolute) return data.noise.absolute;  // no text to format
  return sigma_of(data.noise, value, row_sd,
                  fmt::format("recording '{}', sample {}", data.dataset, sample + 1));
}

std::string data_path(const FitConfig& config, const std::string& dataset) {
  const bool is_file = dataset.ends_with(".csv") || dataset.ends_with(".json");
  if (!is_file || std::filesystem::path(dataset).is_absolute()) return dataset;
  return (config.folder / dataset).string();
}

}  // namespace

std::vector<DataSet> load_data(const FitConfig& config) {
  std::vector<DataSet> data;
  data.reserve(config.data.size());
  for (const DataChoice& choice : config.data) {
    const std::string path = data_path(config, choice.dataset);
    if (choice.protocol.kind == Kind::measured) {
      data.emplace_back(load_recording(path));
    } else {
      data.emplace_back(load_points(path));
    }
  }
  return data;
}

ExperimentResiduals::ExperimentResiduals(const FitConfig& config)
    : ExperimentResiduals(config, load_data(config)) {}

ExperimentResiduals::ExperimentResiduals(const FitConfig& config, const std::vector<DataSet>& data)
    : config_(config), model_(make_model(config)) {
  for (std::size_t i = 0; i < config_.data.size(); ++i) {
    if (const auto* recording = std::get_if<Recording>(&data.at(i))) {
      add_recording(i, *recording);
    } else {
      add_points(i, std::get<PointSet>(data[i]));
    }
  }
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
      datum.choice = choice;
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

void ExperimentResiduals::add_recording(std::size_t choice, const Recording& recording) {
  const DataChoice& data = config_.data[choice];
  require_drive(config_, recording, data.dataset);
  const std::vector<double>& sd = recording.response_sd;
  Protocol history = measured_history(Drive::displacement, recording.time_s, recording.drive);
  history.set_relaxed_at_start(true);
  Experiment experiment{std::move(history), recording.time_s, {}, choice, true};
  const std::size_t n = recording.response.size();
  experiment.data.reserve(n);
  data_.reserve(data_.size() + n);
  for (std::size_t i = 0; i < n; ++i) {
    FitDatum datum;
    datum.choice = choice;
    datum.time_s = recording.time_s[i];
    datum.value = recording.response[i];
    datum.held_out = datum.time_s < data.from_s || datum.time_s > data.to_s;
    datum.provenance = recording.provenance;
    const auto row_sd = sd.empty() ? std::nullopt : std::optional<double>(sd[i]);
    if (!datum.held_out || row_sd) {
      datum.sigma = sample_sigma(data, *datum.value, row_sd, i);
    }
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

Eigen::VectorXd ExperimentResiduals::predict(std::span<const double> natural,
                                             RowMatrix* sensitivity) const {
  const Want want = sensitivity != nullptr ? Want::values_and_sensitivity : Want::values;
  Eigen::VectorXd answer(static_cast<Eigen::Index>(data_.size()));
  if (sensitivity != nullptr) {
    sensitivity->setZero(answer.size(), static_cast<Eigen::Index>(config_.parameters.size()));
  }
  for (const Experiment& experiment : experiments_) {
    const std::vector<double> values = model_parameters(config_, natural, experiment.choice);
    const Response response =
        model_->respond(experiment.protocol, experiment.times_s, values, want);
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
  }
  return answer;
}

std::vector<std::pair<Eigen::Index, Eigen::Index>> ExperimentResiduals::columns_for(
    std::size_t choice) const {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> columns;
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
  d.sigma = sigma_of(noise(d.choice), value, d.sigma, "simulated datum");
  d.value = value;
}

std::string datum_label(const FitDatum& datum) {
  return datum.label.empty() ? fmt::format("t = {:.6g} s", datum.time_s) : datum.label;
}

}  // namespace tpm
