// Declared in tpm/fit/select/selection.hpp.
// A drift of the zero beside a slow branch of the tissue.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/work/give_up.hpp"

namespace tpm::fit {
namespace {

const ParameterResult* not_separable_in(const FitResult& fit) {
  const auto found = std::ranges::find_if(fit.parameters, [](const ParameterResult& p) {
    return p.not_separable && p.not_separable->code == kDriftOrBranch;
  });
  return found == fit.parameters.end() ? nullptr : &*found;
}

/// Words that parameter_words() makes are made again; what stands behind them stays.
template <class Change>
void change_and_say(ParameterResult& p, double level, const Change& change) {
  const std::string before = parameter_words(p, level);
  const std::string behind = p.summary.starts_with(before) ? p.summary.substr(before.size()) : "";
  change();
  p.summary = parameter_words(p, level) + behind;
}

bool has_limits_of(const ParameterResult& p, const ParameterResult& other) {
  return !other.unconfirmed && (!p.lower || other.lower) && (!p.upper || other.upper);
}

/// The interval of a coefficient of the law holds both answers, or there is none. Without profiles
/// its standard error grows until the interval that it stands for holds them.
/// @param other of the fit with a drift; nothing if none was found
/// @param spread half an interval, in standard errors
void hold_both(ParameterResult& p, const ParameterResult* other, const std::optional<Remark>& doubt,
               double level, double spread) {
  const bool profiled = p.verdict != Verdict::not_profiled;
  if (other != nullptr && !profiled && p.standard_error && other->standard_error) {
    const double apart = std::abs(other->estimate - p.estimate);
    p.standard_error = std::max(*p.standard_error, apart / spread + *other->standard_error);
    p.with_drift = WithDrift{other->estimate, {}, {}};
    return;
  }
  if (other != nullptr && (p.lower || p.upper) && has_limits_of(p, *other)) {
    change_and_say(p, level, [&] {
      p.with_drift = WithDrift{other->estimate, other->lower, other->upper};
      if (p.lower) p.lower = std::min(*p.lower, *other->lower);
      if (p.upper) p.upper = std::max(*p.upper, *other->upper);
    });
    return;
  }
  if (p.verdict == Verdict::flat || p.verdict == Verdict::failed || p.unconfirmed) return;
  change_and_say(p, level, [&] { p.not_separable = doubt; });
}

/// Covariance of the free parameters by the fit with a drift, in the order of those without one;
/// the own one where it does not tell all of them.
Eigen::MatrixXd drifting_covariance(const Covariance& own, const Covariance& drifting) {
  if (!drifting.full_rank) return own.theta_covariance();
  std::vector<Eigen::Index> places;
  for (const std::size_t parameter : own.free) {
    const auto at = std::ranges::find(drifting.free, parameter);
    if (at == drifting.free.end()) return own.theta_covariance();
    places.push_back(at - drifting.free.begin());
  }
  return drifting.theta_covariance()(places, places);
}

/// Pools and law files take the covariance of a fit. It becomes that of the fit with a
/// drift and d d', d the difference of both answers, and each standard error at least so large that
/// the interval that it stands for holds both.
void hold_both_in_covariance(FitResult& fit, const FitResult& drifting, double spread) {
  Covariance& own = fit.covariance;
  if (!own.full_rank) return;
  const auto n = std::ssize(own.free);
  Eigen::MatrixXd both = drifting_covariance(own, drifting.covariance);
  Eigen::VectorXd apart(n), least(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::size_t i = own.free[static_cast<std::size_t>(k)];
    const ParameterResult& p = fit.parameters[i];
    const ParameterResult& other = drifting.parameters[i];
    apart[k] = p.parameter.theta(other.estimate) - p.parameter.theta(p.estimate);
    least[k] = own.theta_sd[k];
    if (!p.standard_error || !other.standard_error || !(*p.standard_error > 0.0)) continue;
    const double needed = std::abs(other.estimate - p.estimate) / spread + *other.standard_error;
    least[k] = std::max(1.0, needed / *p.standard_error) * own.theta_sd[k];
  }
  both += apart * apart.transpose();
  const Eigen::VectorXd sd = both.diagonal().cwiseSqrt();
  if (!(sd.minCoeff() > 0.0) || !sd.allFinite()) return;
  const Eigen::VectorXd inverse = sd.cwiseInverse();
  own.correlation = inverse.asDiagonal() * both * inverse.asDiagonal();
  for (Eigen::Index k = 0; k < n; ++k) {
    ParameterResult& p = fit.parameters[own.free[static_cast<std::size_t>(k)]];
    const double wider = std::max(sd[k], least[k]);
    if (p.standard_error) *p.standard_error *= wider / own.theta_sd[k];
    own.theta_sd[k] = wider;
  }
}

/// The search with a drift begins where that without one ended: a drift moves the minimum, but no
/// further than the data leave it open.
void begin_at_minima(FitConfig& config, const FitResult& fit) {
  constexpr std::size_t kMost = 5;
  constexpr std::size_t kBesides = 8;  // starts anywhere
  config.given_starts.clear();
  for (const DistinctMinimum& m : fit.minima) {
    if (config.given_starts.size() == kMost) break;
    std::vector<double> start = m.minimum.natural;
    for (std::size_t j = start.size(); j < config.parameters.size(); ++j) {
      start.push_back(config.parameters[j].fit.start);
    }
    config.given_starts.push_back(std::move(start));
  }
  config.starts = std::min(config.starts, kBesides);
}

}  // namespace

std::optional<DriftAnswers> give_both_drift_answers(FitResult& fit,
                                                    std::span<const PreparedRecording> recordings) {
  return give_both_drift_answers(fit, recordings, data_sets(recordings));
}

std::optional<DriftAnswers> give_both_drift_answers(FitResult& fit,
                                                    std::span<const PreparedRecording> recordings,
                                                    const std::vector<DataSet>& data) {
  const ParameterResult* lasting = not_separable_in(fit);
  if (lasting == nullptr) return std::nullopt;
  DriftAnswers answers;
  answers.k_inf = lasting->estimate;
  FitConfig config = fit.config;
  for (std::size_t i = 0; i < recordings.size(); ++i) add_possible_drift(config, recordings[i], i);
  begin_at_minima(config, fit);
  std::optional<FitResult> drifting;
  const std::string failure = gave_up([&] { drifting = run_fit(config, data); });
  if (!failure.empty()) drifting.reset();
  const std::optional<Remark> doubt = lasting->not_separable;
  const double spread = student_quantile(0.5 + 0.5 * fit.config.level, fit.degrees_of_freedom);
  const std::string& name = lasting->parameter.name;
  if (drifting) hold_both_in_covariance(fit, *drifting, spread);
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const ParameterResult* other = drifting ? &drifting->parameters[i] : nullptr;
    if (p.parameter.name == name && other != nullptr) answers.drifting = other->estimate;
    if (p.nuisance || p.not_separable) continue;
    hold_both(p, other, doubt, fit.config.level, spread);
    fit.config.parameters[i].not_separable = p.not_separable;
  }
  if (!drifting) return answers;
  for (std::size_t i = 0; i < drifting->parameters.size(); ++i) {
    if (config.parameters[i].drift) {
      answers.rate = config.parameters[i].fit.unit;
      answers.drift_per_s.push_back(drifting->parameters[i].estimate);
    }
  }
  return answers;
}

void give_both_drift_answers(FitResult& fit, const std::vector<DataSet>& data) {
  if (not_separable_in(fit) == nullptr) return;
  std::vector<PreparedRecording> recordings;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const auto* recording = std::get_if<Recording>(&data[i]);
    if (recording == nullptr || is_step_response(recording->response_quantity)) return;
    const DataChoice& choice = fit.config.data[i];
    recordings.push_back(prepare_recording(choice.dataset, *recording));
    recordings.back().from_s = choice.from_s;
    recordings.back().to_s = choice.to_s;
  }
  const auto both = give_both_drift_answers(fit, recordings, data);
  if (both) fit.remarks.push_back({"drift_not_separable", drift_words(*both, fit)});
}

std::string drift_words(const DriftAnswers& answers, const FitResult& fit) {
  const ParameterResult* lasting = not_separable_in(fit);
  if (lasting == nullptr) return {};
  const FitParameter& k = lasting->parameter;
  std::string words = fmt::format(
      "{}: not separable, because no rest without a load determines the drift well enough: {} = {} "
      "without a drift of the zero",
      lasting->not_separable->text, k.name, in_sized_unit(*lasting, answers.k_inf));
  if (!answers.drifting) return words + "; no fit with one was found";
  const Unit& rate = answers.rate;
  std::string drifts;
  for (const double drift : answers.drift_per_s) {
    drifts += fmt::format("{}{}", drifts.empty() ? "" : ", ", sized_text(rate, drift, 3));
  }
  return words +
         fmt::format(", {} with one of {}", in_sized_unit(*lasting, *answers.drifting), drifts);
}

}  // namespace tpm::fit
