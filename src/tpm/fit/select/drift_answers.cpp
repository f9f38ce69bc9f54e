// Declared in tpm/fit/select/selection.hpp.
// A drift of the zero beside a slow branch of the tissue.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/work/give_up.hpp"

namespace tpm::fit {
namespace {

const ParameterResult* not_separable_in(const FitResult& fit) {
  const auto found = std::ranges::find_if(
      fit.parameters, [](const ParameterResult& p) { return !p.not_separable.empty(); });
  return found == fit.parameters.end() ? nullptr : &*found;
}

}  // namespace

std::optional<DriftAnswers> drift_answers(const FitResult& fit,
                                          std::span<const PreparedRecording> recordings) {
  const ParameterResult* lasting = not_separable_in(fit);
  if (lasting == nullptr) return std::nullopt;
  DriftAnswers answers;
  answers.k_inf = lasting->estimate;
  FitConfig config = fit.config;
  config.profiles = false;
  for (std::size_t i = 0; i < recordings.size(); ++i) add_possible_drift(config, recordings[i], i);
  const std::string failure = gave_up([&] {
    const FitResult drifting = run_fit(config, data_sets(recordings));
    for (std::size_t i = 0; i < drifting.parameters.size(); ++i) {
      const ParameterResult& p = drifting.parameters[i];
      if (p.parameter.name == lasting->parameter.name) answers.drifting = p.estimate;
      if (config.parameters[i].drift) answers.drift_per_s.push_back(p.estimate);
    }
  });
  if (!failure.empty()) answers.drift_per_s.clear();
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
