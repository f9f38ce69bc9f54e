// Declared in tpm/fit/select/selection.hpp.
// A drift of the zero beside a slow branch of the tissue.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/distributions.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/work/give_up.hpp"

namespace tpm::fit {
namespace {

const ParameterResult* not_separable_in(const FitResult& fit) {
  const auto found = std::ranges::find_if(
      fit.parameters, [](const ParameterResult& p) { return !p.not_separable.empty(); });
  return found == fit.parameters.end() ? nullptr : &*found;
}

/// Words that parameter_words() makes are made again; what stands behind them stays.
template <class Change>
void change_and_say(ParameterResult& p, double level, const Change& change) {
  const std::string before = parameter_words(p, level);
  const std::string behind = p.words.starts_with(before) ? p.words.substr(before.size()) : "";
  change();
  p.words = parameter_words(p, level) + behind;
}

bool has_limits_of(const ParameterResult& p, const ParameterResult& other) {
  return other.unconfirmed.empty() && (!p.lower || other.lower) && (!p.upper || other.upper);
}

/// The interval of a coefficient of the law holds both answers, or there is none. Without profiles
/// its standard error grows until the interval that it stands for holds them.
/// @param other of the fit with a drift; nothing if none was found
/// @param spread half an interval, in standard errors
void hold_both(ParameterResult& p, const ParameterResult* other, const std::string& doubt,
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
  if (p.verdict == Verdict::flat || p.verdict == Verdict::failed) return;
  change_and_say(p, level, [&] { p.not_separable = doubt; });
}

}  // namespace

std::optional<DriftAnswers> give_both_drift_answers(FitResult& fit,
                                                    std::span<const PreparedRecording> recordings) {
  const ParameterResult* lasting = not_separable_in(fit);
  if (lasting == nullptr) return std::nullopt;
  DriftAnswers answers;
  answers.k_inf = lasting->estimate;
  FitConfig config = fit.config;
  for (std::size_t i = 0; i < recordings.size(); ++i) add_possible_drift(config, recordings[i], i);
  std::optional<FitResult> drifting;
  const std::string failure = gave_up([&] { drifting = run_fit(config, data_sets(recordings)); });
  if (!failure.empty()) drifting.reset();
  const std::string doubt = lasting->not_separable;
  const double spread = student_quantile(0.5 + 0.5 * fit.config.level, fit.degrees_of_freedom);
  const std::string& name = lasting->parameter.name;
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    const ParameterResult* other = drifting ? &drifting->parameters[i] : nullptr;
    if (p.parameter.name == name && other != nullptr) answers.drifting = other->estimate;
    if (p.nuisance || !p.not_separable.empty()) continue;
    hold_both(p, other, doubt, fit.config.level, spread);
    fit.config.parameters[i].not_separable = p.not_separable;
  }
  if (!drifting) return answers;
  for (std::size_t i = 0; i < drifting->parameters.size(); ++i) {
    if (config.parameters[i].drift) {
      answers.drift_per_s.push_back(drifting->parameters[i].estimate);
    }
  }
  return answers;
}

std::string drift_words(const DriftAnswers& answers, const FitResult& fit) {
  const ParameterResult* lasting = not_separable_in(fit);
  if (lasting == nullptr) return {};
  const FitParameter& k = lasting->parameter;
  std::string words = fmt::format(
      "{}: not separable, for no rest before contact or after withdrawal tells the "
      "drift well enough: {} = {} without a drift of the zero",
      lasting->not_separable, k.name, in_unit(k, answers.k_inf));
  if (!answers.drifting) return words + "; no fit with one was found";
  const bool force = fit.config.law->response == Quantity::contact_force;
  const Unit rate = per_second(force ? parse_unit("mN", Dimension::force, "drift")
                                     : shown_unit(quantity_dimension(fit.config.law->response)));
  std::string drifts;
  for (const double drift : answers.drift_per_s) {
    drifts += fmt::format("{}{}", drifts.empty() ? "" : ", ", significant(drift / rate.to_si, 3));
  }
  return words +
         fmt::format(", {} with one of {} {}", in_unit(k, *answers.drifting), drifts, rate.symbol);
}

}  // namespace tpm::fit
