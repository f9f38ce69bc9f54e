// Declared in tpm/fit/predict/prediction_parts.hpp.
// A prediction beside a recording.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "tpm/base/sized_unit.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/delayed_rise.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/predict/prediction_parts.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/select/clipping.hpp"
#include "tpm/fit/select/history_before_window.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

/// Adds the directions in which contact and offset of the recording move: with the material (they
/// are found for it by least squares), and with the recording's own noise.
void add_own_directions(UncertainCoordinates& u, const OwnPlacement& own, const Model& model,
                        const LawFile& law, const PreparedRecording& recording,
                        const Protocol& protocol) {
  for (const std::size_t place : own.place) leave_out(u, place);  // of the law: it is found here
  if (own.place.empty()) return;
  const Recording& r = recording.recording;
  std::vector<double> times;
  std::vector<double> sd;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.time_s[i] < recording.from_s || r.time_s[i] > recording.to_s) continue;
    if (is_clipped(recording, r.response[i])) continue;
    times.push_back(r.time_s[i]);
    if (!r.response_sd.empty()) sd.push_back(r.response_sd[i]);
  }
  const Response response =
      model.respond(protocol, times, own.values, Want::values_and_sensitivity);
  const Eigen::MatrixXd material = coordinate_slopes(response, u, own.values);
  std::vector<Eigen::Index> columns(own.place.begin(), own.place.end());
  Eigen::MatrixXd nuisance = response.sensitivity(Eigen::all, columns);
  Eigen::VectorXd sigma = Eigen::VectorXd::Ones(response.value.size());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto own_sd = k < sd.size() ? std::optional<double>(sd[k]) : std::nullopt;
    const auto known = reading_sigma(law.uncertainty->noise, response.value[i], own_sd);
    if (known && *known > 0.0) sigma[i] = *known;
  }
  nuisance = sigma.cwiseInverse().asDiagonal() * nuisance;
  const Eigen::MatrixXd weighted = sigma.cwiseInverse().asDiagonal() * material;
  const Eigen::LDLT<Eigen::MatrixXd> normal(nuisance.transpose() * nuisance);
  const Eigen::MatrixXd follows = -normal.solve(nuisance.transpose() * weighted);
  const auto found = static_cast<Eigen::Index>(own.place.size());
  const Eigen::MatrixXd noise = law.uncertainty->readings_per_independent *
                                normal.solve(Eigen::MatrixXd::Identity(found, found));
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(u.root.rows() + found, u.root.cols() + found);
  root.topLeftCorner(u.root.rows(), u.root.cols()) = u.root;
  root.bottomLeftCorner(found, u.root.cols()) = follows * u.root;
  root.bottomRightCorner(found, found) = covariance_root(noise);
  u.root = std::move(root);
  for (const std::size_t place : own.place) {
    u.place.push_back(place);
    u.coordinate.push_back(Coordinate::linear);
  }
}

/// The file among those that the law was fitted to; none if it was not.
const FittedFile* fitted_file(const LawFile& law, const PreparedRecording& recording) {
  const std::string& sha256 = recording.recording.header.sha256;
  const auto& data = law.uncertainty->data;
  if (sha256.empty()) return nullptr;
  const auto found = std::ranges::find(data, sha256, &FittedFile::sha256);
  return found != data.end() ? &*found : nullptr;
}

/// The placement of one of several recordings that were fitted together.
std::optional<OwnPlacement> placement_in_fit(const LawFile& law, const FittedFile* file) {
  if (file == nullptr || !file->contact || !file->offset) return std::nullopt;
  OwnPlacement own{law.values, {}};
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  const bool own_slack = has_own_slack(law);
  for (std::size_t i = parameters.size() - 2; i < parameters.size(); ++i) {
    if (!own_slack && !belongs_to_recording(law.spec, parameters[i])) continue;
    own.values[i] = parameters[i].name == "offset" ? *file->offset : *file->contact;
    if (std::ranges::find(file->held, parameters[i].name) == file->held.end()) {
      own.place.push_back(i);
    }
  }
  return own;
}

/// Adds the drift of the recording's zero to the response and its bands. Its uncertainty is part of
/// the fit's, not of these bands.
void add_drift(LawPrediction& p, const FittedFile& file) {
  if (!file.drift) return;
  for (std::vector<double>* values :
       {&p.response, &p.mean_lower, &p.mean_upper, &p.reading_lower, &p.reading_upper}) {
    for (std::size_t i = 0; i < values->size(); ++i) (*values)[i] += file.drifted(p.time_s[i]);
  }
  const Unit rate = per_second(shown_unit(p.response_dimension()));
  p.remarks.push_back(
      {"drift_added",
       fmt::format("the zero drifts by {}, as the readings at rest show; it is added",
                   sized_text(rate, *file.drift, 4))});
}

void compare(LawPrediction& p, const LawFile& law, const PreparedRecording& recording) {
  const Recording& r = recording.recording;
  PredictedRecording own;
  own.name = recording.name;
  own.provenance = r.provenance;
  own.observed = r.response;
  struct Sum {
    double squares = 0.0;
    int inside = 0;
  };
  Sum sums[3];
  int clipped = 0;
  PredictionComparison* parts[3] = {&own.fitted, &own.held_out, &own.outside};
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const bool window = r.time_s[i] >= recording.from_s && r.time_s[i] <= recording.to_s;
    bool fitted = false;
    bool at_limit = window && is_clipped(recording, r.response[i]);
    for (const FittedFile& file : law.uncertainty->data) {
      if (file.sha256.empty() || file.sha256 != r.header.sha256) continue;
      if (!file.holds(r.time_s[i])) continue;
      at_limit = at_limit || file.clips(r.response[i]);
      fitted = true;
    }
    fitted = fitted && !at_limit;
    own.in_window.push_back(window);
    own.was_fitted.push_back(fitted);
    if (window) own.peak = std::max(own.peak, std::abs(r.response[i]));
    if (!std::isfinite(p.response[i])) continue;
    if (at_limit) {
      ++clipped;
      continue;
    }
    const std::size_t part = fitted ? 0 : window ? 1 : 2;
    const double off = p.response[i] - r.response[i];
    ++parts[part]->samples;
    parts[part]->largest = std::max(parts[part]->largest, std::abs(off));
    sums[part].squares += off * off;
    if (p.reading_lower.empty()) continue;
    sums[part].inside += r.response[i] >= p.reading_lower[i] && r.response[i] <= p.reading_upper[i];
  }
  for (std::size_t part = 0; part < 3; ++part) {
    const int n = parts[part]->samples;
    if (n == 0) continue;
    parts[part]->rms = std::sqrt(sums[part].squares / n);
    if (!p.reading_lower.empty()) parts[part]->share_in_reading_band = 1.0 * sums[part].inside / n;
  }
  if (clipped > 0) {
    p.remarks.push_back(
        {"clipping",
         fmt::format(
             "clipping: {} readings stand at a limit of the force cell and are not compared",
             clipped)});
  }
  p.recording = std::move(own);
}

}  // namespace

std::optional<std::vector<double>> values_in_fit(const LawFile& law,
                                                 const PreparedRecording& recording) {
  if (!law.uncertainty) return std::nullopt;
  const FittedFile* file = fitted_file(law, recording);
  if (file == nullptr) return std::nullopt;
  const auto of_several = placement_in_fit(law, file);
  if (of_several) return of_several->values;
  if (law.uncertainty->data.size() > 1) return std::nullopt;
  return law.values;
}

namespace {

/// Only a drift is left to find; the rests show it.
OwnPlacement held_placement(const LawFile& law, const PreparedRecording& recording,
                            const PredictionOptions& held) {
  OwnPlacement own{law.values, {}};
  own.values[own.values.size() - 2] = *held.contact;
  own.values.back() = *held.zero;
  const RestReadings rests = read_rests(recording);
  if (drift_finding(recording, rests) == DriftFinding::told) {
    own.drifting.drift = rests.drift->value;
    own.drifting.drift_origin_s = rests.origin_s;
  }
  return own;
}

}  // namespace

OwnPlacement place_recording(const LawFile& law, const PreparedRecording& recording,
                             const PredictionOptions& held) {
  if (held.contact && held.zero) return held_placement(law, recording, held);
  SetupOptions setup;
  setup.contact = held.contact;
  setup.zero = held.zero;
  setup.reference = law.spec.reference;
  setup.profiles = false;
  const FitResult fit = fit_placement(
      law.spec, law.values, recording, setup,
      has_own_slack(law) ? FittedPlacement::slack_too : FittedPlacement::offset_or_contact);
  OwnPlacement result{model_parameters(fit.config, fit.best.natural, 0), {}};
  for (const std::size_t free : fit.covariance.free) {
    const std::vector<Target>& sets = fit.config.parameters[free].sets;
    if (!sets.empty())
      result.place.push_back(sets.front().parameter);  // a drift is none of the law
  }
  for (std::size_t j = 0; j < fit.config.parameters.size(); ++j) {
    if (const std::optional<DriftTerm>& drift = fit.config.parameters[j].drift) {
      result.drifting.drift = fit.best.natural[j];
      result.drifting.drift_origin_s = drift->origin_s;
    }
    if (const std::optional<RiseTerm>& rise = fit.config.parameters[j].rise) {
      result.drifting.rises.push_back({rise->begin_s, rise->end_s, fit.best.natural[j]});
    }
  }
  return result;
}

LawPrediction predict_recording(const LawFile& law, const PreparedRecording& recording,
                                const PredictionOptions& options) {
  const Protocol protocol = imposed_history(recording.recording);
  return predict_recording_by(
      LawModel(law.spec), law, recording, protocol,
      [&] { return place_recording(law, recording, options); }, options);
}

void require_quantities_of(const LawFile& law, const PreparedRecording& recording) {
  const Recording& r = recording.recording;
  if (law_drive(r) != law.spec.drive || law_response(r) != law.spec.response) {
    throw bad_input(
        fmt::format("recording '{}'", recording.name),
        fmt::format("{} over {}", quantity_name(law_response(r)), quantity_name(law_drive(r))),
        fmt::format("{} over {}, as the law answers", quantity_name(law.spec.response),
                    quantity_name(law.spec.drive)));
  }
}

LawPrediction predict_recording_by(const Model& model, const LawFile& law,
                                   const PreparedRecording& recording, const Protocol& motion,
                                   const std::function<OwnPlacement()>& place,
                                   const PredictionOptions& options) {
  LawPrediction p = begin_prediction(law, options);
  const Recording& r = recording.recording;
  require_quantities_of(law, recording);
  const bool holds = options.contact || options.zero;
  if (holds && law.spec.drive != Quantity::indentation_depth) {
    throw Error(ExitCode::usage, "--contact, --zero", "with a law of stress",
                "them with a law of contact force over indentation depth");
  }
  if (holds && options.placement.value_or(Placement::own) != Placement::own) {
    throw Error(ExitCode::usage, "--contact, --zero",
                fmt::format("with --placement {}", placement_name(*options.placement)),
                "them with --placement own, or without --placement");
  }
  const bool known = !holds && values_in_fit(law, recording).has_value();
  p.placement = options.placement.value_or(known ? Placement::fitted : Placement::own);
  if (p.placement == Placement::fitted && !known && law.uncertainty->data.size() > 1) {
    throw bad_input(fmt::format("recording '{}'", recording.name),
                    "the law was fitted to several recordings, and this is none of them",
                    "--placement own or surface");
  }
  const auto in_fit = placement_in_fit(law, fitted_file(law, recording));
  const bool of_several = p.placement == Placement::fitted && in_fit;
  UncertainCoordinates u = fitted_coordinates(law, of_several ? Placement::own : p.placement);
  std::vector<double> values = law.values;
  FittedFile drifting;
  if (const FittedFile* file = fitted_file(law, recording);
      file != nullptr && p.placement == Placement::fitted) {
    drifting = *file;
  }
  if (of_several) {
    values = in_fit->values;
    add_own_directions(u, *in_fit, model, law, recording, motion);
  } else if (p.placement == Placement::own) {
    const OwnPlacement own = place();
    values = own.values;
    drifting = own.drifting;
    add_own_directions(u, own, model, law, recording, motion);
  } else if (p.placement == Placement::surface) {
    values = at_surface(law).values;
  }
  p.contact = values[values.size() - 2];
  p.offset = values.back();
  p.time_s = r.time_s;
  fill_prediction(p, model, law, with_delays(motion, drifting.rises), u, values, r.response_sd,
                  options);
  if (motion.drive() == Drive::force) {  // the noise of the law file is one of stresses
    p.reading_lower.clear();
    p.reading_upper.clear();
  }
  add_drift(p, drifting);
  if (auto remark = history_before_window(law.spec, values, recording, "the prediction")) {
    p.remarks.insert(p.remarks.begin(), *std::move(remark));
  }
  compare(p, law, recording);
  return p;
}

void leave_out(UncertainCoordinates& u, std::size_t place) {
  const auto found = std::ranges::find(u.place, place);
  if (found == u.place.end()) return;
  const auto at = found - u.place.begin();
  u.place.erase(found);
  u.coordinate.erase(u.coordinate.begin() + at);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < u.root.rows(); ++i) {
    if (i != at) kept.push_back(i);
  }
  u.root = Eigen::MatrixXd(u.root(kept, Eigen::all));
}

bool has_own_slack(const LawFile& law) {
  if (law.spec.drive != Quantity::relative_length || !law.uncertainty) return false;
  std::optional<double> first;
  for (const FittedFile& file : law.uncertainty->data) {
    if (!file.contact) continue;
    if (first && *file.contact != *first) return true;
    first = file.contact;
  }
  return false;
}

}  // namespace tpm::fit
