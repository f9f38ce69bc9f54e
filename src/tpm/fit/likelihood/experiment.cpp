#include "tpm/fit/likelihood/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "tpm/base/lists.hpp"
#include "tpm/data/straight_pieces.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

using Kind = ProtocolChoice::Kind;
using Part = Oscillation::Part;

bool matches_any(const std::vector<Selector>& selectors, const Datum& datum) {
  return std::ranges::any_of(selectors, [&](const Selector& s) { return s.matches(datum); });
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
  if (has_drive && law_drive(recording) == spec.drive && law_response(recording) == spec.response) {
    return;
  }
  throw bad_input(fmt::format("recording '{}'", name),
                  has_drive ? fmt::format("{} over {}", quantity_name(recording.response_quantity),
                                          quantity_name(recording.drive_quantity))
                            : std::string("no times or no drive"),
                  fmt::format("{} over {}, with times", quantity_name(spec.response),
                              quantity_name(spec.drive)));
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

void add_points(ExperimentSet& set, const FitConfig& config, std::size_t choice,
                const PointSet& points) {
  const DataChoice& data = config.data[choice];
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
      places.push_back(set.data.size());
      set.data.push_back(std::move(datum));
    }
    set.experiments.push_back({std::move(course), std::move(places), choice});
  }
}

/// Relaxation modulus or creep compliance: readings after a unit step at time 0.
void add_step_response(ExperimentSet& set, const FitConfig& config, std::size_t choice,
                       const Recording& recording) {
  const DataChoice& data = config.data[choice];
  const std::string where = fmt::format("recording '{}'", data.dataset);
  if (!config.law || !is_answered_by_stress(config.law->drive)) {
    throw bad_input(where,
                    fmt::format("{} and another law", quantity_name(recording.response_quantity)),
                    "a law of stress: \"drive\": \"strain\" (or \"relative_length\")");
  }
  if (recording.time_s.empty() || !(recording.time_s.front() >= 0.0)) {
    throw bad_input(where, "no times, or times before the step", "times from 0 on");
  }
  const bool relaxation = recording.response_quantity == Quantity::relaxation_modulus;
  constexpr double kUnit = 1.0;  // of strain, or of stress in Pa
  TimeCourse course{relaxation ? step_and_hold(kUnit, std::numeric_limits<double>::infinity())
                               : creep(kUnit, std::numeric_limits<double>::infinity()),
                    {}};
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < recording.response.size(); ++i) {
    FitDatum datum;
    datum.choice = choice;
    datum.quantity = recording.response_quantity;
    datum.time_s = recording.time_s[i];
    datum.value = recording.response[i];
    datum.held_out = datum.time_s < data.from_s || datum.time_s > data.to_s;
    datum.provenance = recording.provenance;
    const auto& sd = recording.response_sd;
    datum.sigma =
        sample_sigma(data, *datum.value, sd.empty() ? std::nullopt : std::optional(sd[i]), i);
    course.times_s.push_back(datum.time_s);
    places.push_back(set.data.size());
    set.data.push_back(std::move(datum));
  }
  set.experiments.push_back({std::move(course), std::move(places), choice});
}

/// Censors the readings of a recording at the limits of the force cell. Their likelihood is known
/// where the noise adds and is normal; elsewhere nothing is asked of them.
void censor_recording(std::vector<FitDatum>& data, std::span<const std::size_t> places,
                      const DataChoice& choice) {
  constexpr double kOpen = std::numeric_limits<double>::infinity();
  const Noise& noise = choice.noise;
  const bool adds = noise.kind != NoiseKind::log && noise.kind != NoiseKind::relative_to_model &&
                    noise.shape == ErrorShape::normal && !choice.estimates_sigma();
  for (const std::size_t place : places) {
    FitDatum& d = data[place];
    if (d.held_out || !d.value) continue;
    const bool above = choice.is_clipped_above(*d.value);
    if (!above && !choice.is_clipped_below(*d.value)) continue;
    d.lower = above ? *choice.clipped_above : -kOpen;
    d.upper = above ? kOpen : *choice.clipped_below;
    if (!adds) d.sigma = kOpen;
    d.at_limit = d.value;
    d.value.reset();
  }
}

void add_recording(ExperimentSet& set, const FitConfig& config, std::size_t choice,
                   const Recording& recording) {
  if (is_step_response(recording.response_quantity)) {
    add_step_response(set, config, choice, recording);
    return;
  }
  const DataChoice& data = config.data[choice];
  require_drive(config, recording, data.dataset);
  const std::vector<double>& sd = recording.response_sd;
  TimeCourse course{imposed_history(recording), recording.time_s};
  if (config.organ) course.followed = followed_by_organ(course.protocol);
  Experiment experiment{std::move(course), {}, choice, true};
  const std::size_t n = recording.response.size();
  experiment.data.reserve(n);
  set.data.reserve(set.data.size() + n);
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
    experiment.data.push_back(set.data.size());
    set.data.push_back(std::move(datum));
  }
  if (data.clipped_above || data.clipped_below) censor_recording(set.data, experiment.data, data);
  set.experiments.push_back(std::move(experiment));
}

void add_spectrum(ExperimentSet& set, const FitConfig& config, std::size_t choice,
                  const Spectrum& spectrum) {
  const DataChoice& data = config.data[choice];
  const SpectrumQuantities quantities = spectrum_quantities(spectrum.dimension);
  Oscillation oscillation = oscillation_of(config, data, spectrum);
  std::vector<std::size_t> places;
  const auto add = [&](std::size_t row, Part part, Quantity quantity,
                       const std::vector<double>& values, const std::vector<double>& sds) {
    const bool storage = part == Part::storage;
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
    if (data.noise.angle_rad) {
      const PartsNoise noise =
          noise_of_parts(data.noise, spectrum.storage[row], spectrum.loss[row]);
      const bool beside =
          !oscillation.readings.empty() && oscillation.readings.back().frequency == row;
      datum.sigma = storage ? noise.storage_sd : noise.loss_sd;
      if (beside) datum.correlation = noise.correlation;
    } else {
      datum.sigma =
          value_sigma(data, values[row], sds.empty() ? std::nullopt : std::optional(sds[row]),
                      fmt::format("spectrum '{}', {}", data.dataset, datum.label));
    }
    datum.provenance = spectrum.provenance;
    datum.held_out = matches_any(data.hold_out, reading);
    oscillation.readings.push_back({row, part});
    places.push_back(set.data.size());
    set.data.push_back(std::move(datum));
  };
  for (std::size_t i = 0; i < spectrum.frequency_Hz.size(); ++i) {
    add(i, Part::storage, quantities.storage, spectrum.storage, spectrum.storage_sd);
    add(i, Part::loss, quantities.loss, spectrum.loss, spectrum.loss_sd);
  }
  set.experiments.push_back({std::move(oscillation), std::move(places), choice});
}

}  // namespace

std::string data_path(const FitConfig& config, const std::string& dataset) {
  // Ids of shipped curves hold letters, digits and '_'; recordings end as their instruments like.
  const bool is_file = dataset.find_first_of("./") != std::string::npos;
  if (!is_file || std::filesystem::path(dataset).is_absolute()) return dataset;
  return (config.folder / dataset).string();
}

std::vector<DataSet> load_data(const FitConfig& config) {
  return mapped<DataSet>(config.data, [&](const DataChoice& choice) -> DataSet {
    const std::string path = data_path(config, choice.dataset);
    if (choice.protocol.kind == Kind::measured) {
      Recording recording = read_recording_file(path, choice.import).recording;
      return choice.load_imposed ? with_imposed_load(std::move(recording)) : recording;
    }
    if (choice.protocol.kind == Kind::oscillation) return read_spectrum_file(path, choice.import);
    return load_points(path);
  });
}

ExperimentSet set_up_experiments(const FitConfig& config, const std::vector<DataSet>& data) {
  ExperimentSet set;
  for (std::size_t i = 0; i < config.data.size(); ++i) {
    if (const auto* recording = std::get_if<Recording>(&data.at(i))) {
      add_recording(set, config, i, *recording);
    } else if (const auto* spectrum = std::get_if<Spectrum>(&data[i])) {
      add_spectrum(set, config, i, *spectrum);
    } else {
      add_points(set, config, i, std::get<PointSet>(data[i]));
    }
  }
  return set;
}

double value_sigma(const DataChoice& data, double value, std::optional<double> row_sd,
                   const std::string& where) {
  const double sigma =
      data.estimates_sigma() && data.noise.kind != NoiseKind::log
          ? 0.0
          : sigma_of(data.noise, value, row_sd, where);  // also refuses what has no logarithm
  return data.estimates_sigma() ? 0.0 : sigma;
}

std::string datum_label(const FitDatum& datum) {
  return datum.label.empty() ? fmt::format("t = {:.6g} s", datum.time_s) : datum.label;
}

}  // namespace tpm::fit
