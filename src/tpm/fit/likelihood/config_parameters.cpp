// Declared in tpm/fit/likelihood/config_parts.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/likelihood/config_parts.hpp"
#include "tpm/organ/scene/organ_model.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::fit {
namespace {

std::size_t target_of(std::string_view name, const Model& model, const DocumentPlace& place) {
  const auto all = model.parameters();
  const auto found = std::ranges::find(all, name, &ParameterDescription::name);
  if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
  throw unknown_word(place.where, "no model parameter is called", name,
                     mapped<std::string>(all, &ParameterDescription::name));
}

/// The places of the data sets of these names.
std::vector<std::size_t> scope_of(const std::vector<Placed<std::string>>& names,
                                  const FitConfig& config) {
  std::vector<std::size_t> scope;
  for (const auto& [name, place] : names) {
    const std::size_t before = scope.size();
    for (std::size_t i = 0; i < config.data.size(); ++i) {
      if (config.data[i].dataset == name) scope.push_back(i);
    }
    if (scope.size() > before) continue;
    throw bad_input(place.where, fmt::format("'{}' is no data set of this fit", printable(name)),
                    "a name that stands under /data");
  }
  return scope;
}

std::optional<Prior> prior_of(const std::optional<StatedPrior>& stated, Dimension dimension) {
  if (!stated) return std::nullopt;
  const Prior prior{stated->mean.in(dimension), stated->sd.in(dimension), stated->from,
                    stated->measured};
  if (prior.sd > 0.0) return prior;
  throw bad_input(stated->sd.place.where, "not above 0", "a standard deviation above 0");
}

/// "1 mN/s" as "1 mN": what changes per second.
void remove_second(StatedQuantity& rate) {
  constexpr std::string_view kPerSecond = "/s";
  if (!rate.text.ends_with(kPerSecond)) {
    throw bad_input(rate.place.where, fmt::format("'{}' is no drift", printable(rate.text)),
                    "the recording's response per second, such as \"1 mN/s\"");
  }
  rate.text.resize(rate.text.size() - kPerSecond.size());
}

/// The place in config.data of the recording that a drift or a rise belongs to.
std::size_t recording_of(const Placed<std::string>& of, const FitConfig& config) {
  const auto found = std::ranges::find(config.data, of.value, &DataChoice::dataset);
  if (found != config.data.end() && found->protocol.kind == FitProtocol::measured) {
    return static_cast<std::size_t>(found - config.data.begin());
  }
  throw bad_input(of.place.where,
                  fmt::format("'{}' is no recording of this fit", printable(of.value)),
                  "the name of a recording (protocol 'measured') under /data");
}

/// Name, start, bounds and scale of an estimated parameter.
FitParameter search_of(const std::string& name, const StatedParameter& stated,
                       Dimension dimension) {
  FitParameter fit;
  fit.name = name;
  fit.start = stated.start.in(dimension);
  fit.unit = stated.start.unit(dimension);
  fit.lower = stated.lower.in(dimension);
  fit.upper = stated.upper.in(dimension);
  fit.scale = stated.scale.value_or(Scale::log);
  require_valid(fit, stated.place.where);
  return fit;
}

/// A linear drift of the zero of one recording.
EstimatedParameter drift_of(const std::string& name, StatedParameter stated,
                            const FitConfig& config) {
  const std::size_t choice = recording_of(stated.drift->of, config);
  const Dimension dimension = reading_dimension(config, config.data[choice]);
  for (StatedQuantity* rate : {&stated.start, &stated.lower, &stated.upper}) remove_second(*rate);
  if (stated.prior) {
    remove_second(stated.prior->mean);
    remove_second(stated.prior->sd);
  }
  stated.scale = stated.scale.value_or(Scale::linear);
  EstimatedParameter parameter;
  parameter.fit = search_of(name, stated, dimension);
  parameter.fit.unit = per_second(parameter.fit.unit);
  parameter.prior = prior_of(stated.prior, dimension);
  parameter.drift = DriftTerm{choice, stated.drift->origin_s};
  return parameter;
}

/// The delay of a rise of one recording's drive between two samples.
EstimatedParameter rise_of(const std::string& name, const StatedParameter& stated,
                           const FitConfig& config) {
  const StatedRise& rise = *stated.rise;
  if (config.organ) {
    throw bad_input(stated.place.where, "a rise with the model 'organ'", "a law");
  }
  EstimatedParameter parameter;
  parameter.fit = search_of(name, stated, Dimension::time);
  parameter.prior = prior_of(stated.prior, Dimension::time);
  parameter.rise = RiseTerm{recording_of(rise.of, config), rise.begin_s, rise.end_s};
  return parameter;
}

/// The model parameters that take the value of an estimated one. They have one dimension.
std::vector<Target> targets_of(const std::string& name, const StatedParameter& stated,
                               const Model& model, const FitConfig& config) {
  const std::vector<std::size_t> scope = scope_of(stated.data, config);
  if (stated.sets.empty()) return {{target_of(name, model, stated.place), scope}};
  std::vector<Target> targets;
  for (const auto& [target, place] : stated.sets) {
    targets.push_back({target_of(target, model, place), scope});
    const auto dimension = [&](const Target& t) {
      return model.parameters()[t.parameter].dimension;
    };
    if (dimension(targets.back()) == dimension(targets.front())) continue;
    throw bad_input(place.where, "the parameters set have different dimensions",
                    "parameters of one dimension");
  }
  return targets;
}

EstimatedParameter parameter_of(const std::string& name, const StatedParameter& stated,
                                const Model& model, const FitConfig& config) {
  if (stated.drift) return drift_of(name, stated, config);
  if (stated.rise) return rise_of(name, stated, config);
  EstimatedParameter parameter;
  parameter.sets = targets_of(name, stated, model, config);
  const Dimension dimension = model.parameters()[parameter.sets.front().parameter].dimension;
  parameter.fit = search_of(name, stated, dimension);
  parameter.prior = prior_of(stated.prior, dimension);
  parameter.not_separable = stated.not_separable;
  const FitParameter& fit = parameter.fit;
  for (const Target& target : parameter.sets) {
    const auto [low, high] = model.range(target.parameter);
    if (fit.lower >= low && fit.upper <= high) continue;
    throw bad_input(
        (fit.lower < low ? stated.lower : stated.upper).place.where,
        fmt::format("outside the range of {}", model.parameters()[target.parameter].name),
        fmt::format("bounds from {} to {} (SI)", shortest(low), shortest(high)));
  }
  return parameter;
}

const EstimatedParameter& find_parameter(const FitConfig& config, const std::string& name,
                                         const DocumentPlace& place) {
  for (const EstimatedParameter& p : config.parameters) {
    if (p.fit.name == name) return p;
  }
  const auto names = mapped<std::string>(config.parameters,
                                         [](const EstimatedParameter& p) { return p.fit.name; });
  throw bad_input(place.where,
                  fmt::format("'{}' is not an estimated parameter{}", printable(name),
                              did_you_mean(name, names)),
                  "a name from /parameters");
}

/// The noise parameters that the data sets name, with their dimensions, each once. Throws
/// Error(bad_input) for a name that stands for two dimensions.
std::vector<std::pair<std::string, Dimension>> noise_parameters(
    const FitConfig& config, const std::vector<StatedData>& stated) {
  std::vector<std::pair<std::string, Dimension>> list;
  const auto add = [&](const std::string& name, Dimension dimension, const DocumentPlace& place) {
    const auto same = [&](const auto& entry) { return entry.first == name; };
    const auto found = std::find_if(list.begin(), list.end(), same);
    if (name.empty()) return;
    if (found == list.end()) {
      list.emplace_back(name, dimension);
    } else if (found->second != dimension) {
      throw bad_input(place.where,
                      fmt::format("noise parameter '{}' is {} and {}", printable(name),
                                  dimension_name(found->second), dimension_name(dimension)),
                      "one noise parameter for each dimension");
    }
  };
  for (std::size_t i = 0; i < config.data.size(); ++i) {
    const DataChoice& data = config.data[i];
    add(data.sigma_a, reading_dimension(config, data), stated[i].noise.place);
    add(data.sigma_b, Dimension::dimensionless, stated[i].noise.place);
  }
  return list;
}

/// A noise parameter: as the file states it, or for the data to decide.
EstimatedParameter noise_parameter_of(const std::string& name, Dimension dimension,
                                      const StatedFit& whole) {
  const auto found =
      std::ranges::find(whole.parameters, name, &std::pair<std::string, StatedParameter>::first);
  EstimatedParameter parameter;
  if (found == whole.parameters.end()) {
    parameter.fit.name = name;
    parameter.fit.unit = shown_unit(dimension);
    parameter.from_data = true;
    return parameter;
  }
  const StatedParameter& stated = found->second;
  if (!stated.sets.empty() || !stated.data.empty() || stated.prior) {
    throw bad_input(stated.place.where, "'sets', 'for' or 'prior' of a parameter of the noise",
                    "data sets that name it under /noise");
  }
  parameter.fit = search_of(name, stated, dimension);
  if (parameter.fit.lower > 0.0) return parameter;
  throw bad_input(stated.lower.place.where, "not above 0", "a positive lower bound");
}

}  // namespace

std::vector<EstimatedParameter> parameters_of(const StatedFit& stated, const Model& model,
                                              const FitConfig& config) {
  const auto of_noise = noise_parameters(config, stated.data);
  std::vector<EstimatedParameter> parameters;
  for (const auto& [name, one] : stated.parameters) {
    const bool is_noise = std::any_of(of_noise.begin(), of_noise.end(),
                                      [&n = name](const auto& entry) { return entry.first == n; });
    if (!is_noise) parameters.push_back(parameter_of(name, one, model, config));
  }
  for (const auto& [name, dimension] : of_noise) {
    parameters.push_back(noise_parameter_of(name, dimension, stated));
  }
  return parameters;
}

std::vector<double> fixed_values(const StatedValues& stated, const Model& model,
                                 const FitConfig& config) {
  std::vector<double> values;
  if (config.law) {
    for (const LawParameter& p : law_parameters(*config.law)) {
      values.push_back(p.preset.value_or(std::numeric_limits<double>::quiet_NaN()));
    }
  } else if (config.organ) {
    values = OrganModel(config.organ).own_values();
  } else {
    const TpmVector paper = to_vector({});
    values.assign(paper.begin(), paper.end());
  }
  for (const auto& [name, value] : stated) {
    const std::size_t target = target_of(name, model, value.place);
    values[target] = value.in(model.parameters()[target].dimension);
  }
  return values;
}

void require_each_set_once(const FitConfig& config, const Model& model, const StatedValues& fixed,
                           const DocumentPlace& place) {
  for (std::size_t choice = 0; choice < config.data.size(); ++choice) {
    std::vector<std::string> setter(model.parameters().size());
    const auto claim = [&](std::size_t target, const std::string& by) {
      std::string& owner = setter[target];
      if (!owner.empty()) {
        throw bad_input(place.where,
                        fmt::format("model parameter '{}' is set by '{}' and by '{}'",
                                    model.parameters()[target].name, owner, by),
                        "each model parameter set once");
      }
      owner = by;
    };
    for (const EstimatedParameter& p : config.parameters) {
      for (const Target& target : p.sets) {
        if (target.applies_to(choice)) claim(target.parameter, p.fit.name);
      }
    }
    for (const auto& [name, value] : fixed) claim(target_of(name, model, value.place), "fixed");
    for (std::size_t i = 0; i < setter.size(); ++i) {
      if (!setter[i].empty() || !std::isnan(config.fixed[i])) continue;
      throw bad_input(place.where,
                      fmt::format("model parameter '{}' has no value for '{}'",
                                  model.parameters()[i].name, config.data[choice].dataset),
                      "it under /parameters or /fixed");
    }
  }
}

std::vector<Hypothesis> hypotheses_of(const std::vector<StatedHypothesis>& stated,
                                      const FitConfig& config) {
  return mapped<Hypothesis>(stated, [&](const StatedHypothesis& one) {
    Hypothesis hypothesis{one.name, {}};
    for (const auto& [name, value] : one.values) {
      const FitParameter& p = find_parameter(config, name, value.place).fit;
      const double si = value.in(p.unit.dimension);
      if (!(si >= p.lower && si <= p.upper)) {
        throw bad_input(value.place.where,
                        fmt::format("{} is outside the parameter's bounds", value.text),
                        "a value within them");
      }
      hypothesis.values.emplace_back(name, si);
    }
    return hypothesis;
  });
}

}  // namespace tpm::fit
