#include "tpm/fit/experiment_residuals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/curve/load.hpp"
#include "tpm/curve/recording_file.hpp"

namespace tpm {
namespace {

using Kind = ProtocolChoice::Kind;
using Part = Oscillation::Part;

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
    case Kind::oscillation:
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

/// Scale of the noise of a value; 0 where it is among the estimated parameters.
double value_sigma(const DataChoice& data, double value, std::optional<double> row_sd,
                   const std::string& where) {
  const double sigma =
      data.estimates_sigma() && data.noise.kind != NoiseKind::log
          ? 0.0
          : sigma_of(data.noise, value, row_sd, where);  // also refuses what has no logarithm
  return data.estimates_sigma() ? 0.0 : sigma;
}

/// Scale of the tail outside a band, relative to the band's middle whatever the convention for
/// values.
double band_sigma(const DataChoice& data, double middle, std::optional<double> row_sd,
                  const std::string& where) {
  if (data.estimates_sigma()) {
    throw bad_input(where, "a band, and the noise is to be estimated",
                    "values, or a stated standard deviation");
  }
  const double sigma = sigma_of(data.noise, middle, row_sd, where);
  if (data.noise.kind == NoiseKind::absolute || data.noise.kind == NoiseKind::per_row) return sigma;
  return data.noise.absolute + data.noise.relative * middle;
}

double sample_sigma(const DataChoice& data, double value, std::optional<double> row_sd,
                    std::size_t sample) {
  if (data.estimates_sigma() && data.noise.kind != NoiseKind::log) return 0.0;
  if (data.noise.kind == NoiseKind::absolute) return data.noise.absolute;  // no text to format
  return value_sigma(data, value, row_sd,
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
      data.emplace_back(read_recording_file(path, choice.import).recording);
    } else if (choice.protocol.kind == Kind::oscillation) {
      data.emplace_back(load_spectrum(path));
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
    } else if (const auto* spectrum = std::get_if<Spectrum>(&data[i])) {
      add_spectrum(i, *spectrum);
    } else {
      add_points(i, std::get<PointSet>(data[i]));
    }
  }
  resolve_noise_parameters();
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
    TimeCourse course{protocol_for(data.protocol, condition, longest_s), {}};
    std::vector<std::size_t> places;
    for (const Datum* d : rows) {
      const std::string where = fmt::format("data set '{}', line {}", data.dataset, d->line);
      FitDatum datum;
      datum.choice = choice;
      datum.label = condition_of(*d);
      datum.quantity = observable_quantity(points.observable);
      datum.time_s = time_in_protocol(data.protocol, *d, condition, where);
      datum.value = d->value;
      datum.lower = d->lower;
      datum.upper = d->upper;
      datum.sigma = d->value ? value_sigma(data, *d->value, d->sd, where)
                             : band_sigma(data, 0.5 * (*d->lower + *d->upper), d->sd, where);
      datum.provenance = d->provenance;
      datum.held_out = matches_any(data.hold_out, *d);
      course.times_s.push_back(datum.time_s);
      places.push_back(data_.size());
      data_.push_back(std::move(datum));
    }
    experiments_.push_back({std::move(course), std::move(places), choice});
  }
}

void ExperimentResiduals::add_recording(std::size_t choice, const Recording& recording) {
  const DataChoice& data = config_.data[choice];
  require_drive(config_, recording, data.dataset);
  const std::vector<double>& sd = recording.response_sd;
  Protocol history = measured_history(Drive::displacement, recording.time_s, recording.drive);
  history.set_relaxed_at_start(true);
  Experiment experiment{TimeCourse{std::move(history), recording.time_s}, {}, choice, true};
  const std::size_t n = recording.response.size();
  experiment.data.reserve(n);
  data_.reserve(data_.size() + n);
  for (std::size_t i = 0; i < n; ++i) {
    FitDatum datum;
    datum.choice = choice;
    datum.quantity = recording.response_quantity;
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

void ExperimentResiduals::add_spectrum(std::size_t choice, const Spectrum& spectrum) {
  const DataChoice& data = config_.data[choice];
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  Oscillation oscillation = oscillation_of(config_, data, spectrum);
  std::vector<std::size_t> places;
  const auto add = [&](std::size_t row, Part part, Quantity quantity,
                       const std::vector<double>& values, const std::vector<double>& sds) {
    const double frequency = spectrum.frequency_Hz[row];
    Datum reading;  // what selectors see
    reading.label = oscillation_label(quantity, frequency);
    if (matches_any(data.exclude, reading)) return;
    FitDatum datum;
    datum.choice = choice;
    datum.label = reading.label;
    datum.quantity = quantity;
    datum.frequency_Hz = frequency;
    datum.value = values[row];
    datum.sigma =
        value_sigma(data, values[row], sds.empty() ? std::nullopt : std::optional(sds[row]),
                    fmt::format("spectrum '{}', {}", data.dataset, datum.label));
    datum.provenance = spectrum.provenance;
    datum.held_out = matches_any(data.hold_out, reading);
    oscillation.readings.push_back({row, part});
    places.push_back(data_.size());
    data_.push_back(std::move(datum));
  };
  for (std::size_t i = 0; i < spectrum.frequency_Hz.size(); ++i) {
    add(i, Part::storage, quantities.storage, spectrum.storage, spectrum.storage_sd);
    add(i, Part::loss, quantities.loss, spectrum.loss, spectrum.loss_sd);
  }
  experiments_.push_back({std::move(oscillation), std::move(places), choice});
}

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

void ExperimentResiduals::leave_out_held_out() {
  fitted_.clear();
  const bool any =
      std::any_of(data_.begin(), data_.end(), [](const auto& d) { return d.held_out; });
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

Response ExperimentResiduals::respond_to(const Experiment& experiment,
                                         std::span<const double> parameters, Want want) const {
  if (const auto* oscillation = std::get_if<Oscillation>(&experiment.imposed)) {
    return respond(*oscillation, parameters, want);
  }
  const auto& course = std::get<TimeCourse>(experiment.imposed);
  return model_->respond(course.protocol, course.times_s, parameters, want);
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
    const std::vector<double> values = model_parameters(config_, natural, experiment.choice);
    const Response response = respond_to(experiment, values, want);
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
    answer = answers(fitted_.empty() ? experiments_ : fitted_, natural,
                     jacobian != nullptr ? &sensitivity : nullptr);
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
        const DatumResidual r = band_residual(d.sigma, *d.lower, *d.upper, answer[index]);
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
  return residual.allFinite();
}

void ExperimentResiduals::write_row(const NoiseTerm& term, const MovingSigma& moving, double factor,
                                    const Eigen::Ref<const Eigen::RowVectorXd>& sensitivity,
                                    Eigen::Ref<Eigen::RowVectorXd> row) {
  row = factor * term.by_f * sensitivity;
  if (moving.a) row[static_cast<Eigen::Index>(*moving.a)] += factor * term.by_a;
  if (moving.b) row[static_cast<Eigen::Index>(*moving.b)] += factor * term.by_b;
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
  FitDatum& d = data_.at(datum);
  d.sigma = value_sigma(config_.data[d.choice], value, d.sigma, "simulated datum");
  d.value = value;
}

double ExperimentResiduals::weight(std::size_t datum) const {
  return counts_.empty() ? 1.0 : std::sqrt(static_cast<double>(counts_[datum]));
}

void ExperimentResiduals::set_counts(std::vector<int> counts) {
  counts_ = std::move(counts);
  count_residuals();
}

std::unique_ptr<ExperimentResiduals> ExperimentResiduals::thinned(std::size_t most) const {
  auto few = copy();
  for (Experiment& experiment : few->experiments_) {
    const std::size_t n = experiment.data.size();
    if (!experiment.is_recording || n <= most) continue;
    auto& course = std::get<TimeCourse>(experiment.imposed);
    const std::size_t stride = (n + most - 1) / most;
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
    protocol.set_relaxed_at_start(course.protocol.relaxed_at_start());
    course = {std::move(protocol), std::move(times_s)};
    experiment.data = std::move(data);
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
  other->residual_count_ = residual_count_;
  other->offset_ = offset_;
  return other;
}

std::string datum_label(const FitDatum& datum) {
  return datum.label.empty() ? fmt::format("t = {:.6g} s", datum.time_s) : datum.label;
}

}  // namespace tpm
