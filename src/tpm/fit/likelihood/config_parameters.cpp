// Declared in tpm/fit/likelihood/config_parts.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/likelihood/config_parts.hpp"
#include "tpm/organ/scene/organ_model.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::fit {
namespace {

std::size_t parse_target(std::string_view name, const Model& model, const DocumentPlace& place) {
  const auto all = model.parameters();
  const auto found = std::ranges::find(all, name, &ParameterDescription::name);
  if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
  throw unknown_word(place.where, "no model parameter is called", name,
                     mapped<std::string>(all, &ParameterDescription::name));
}

/// The places of the data sets named under "for".
std::vector<std::size_t> parse_scope(const Json& j, const FitConfig& config,
                                     const DocumentPlace& place) {
  std::vector<std::size_t> scope;
  if (!j.contains("for")) return scope;
  for (const auto& name : j.at("for")) {
    const auto dataset = name.get<std::string>();
    bool found = false;
    for (std::size_t i = 0; i < config.data.size(); ++i) {
      if (config.data[i].dataset != dataset) continue;
      scope.push_back(i);
      found = true;
    }
    if (found) continue;
    throw bad_input(place.key("for").where,
                    fmt::format("'{}' is no data set of this fit", printable(dataset)),
                    "a name that stands under /data");
  }
  return scope;
}

/// "prior" of a parameter, by what reads a quantity of it under a key.
template <class Read>
std::optional<Prior> parse_prior(const Json& j, const DocumentPlace& place, const Read& read) {
  if (!j.contains("prior")) return std::nullopt;
  const DocumentPlace here = place.key("prior");
  const Prior prior{read(j.at("prior"), "mean", here), read(j.at("prior"), "sd", here),
                    j.at("prior").value("from", "")};
  if (prior.sd > 0.0) return prior;
  throw bad_input(here.key("sd").where, "not above 0", "a standard deviation above 0");
}

/// "1 mN/s" as "1 mN": what changes per second.
std::string without_second(const Json& j, std::string_view key, const DocumentPlace& place) {
  constexpr std::string_view kPerSecond = "/s";
  std::string text = j.at(std::string(key)).get<std::string>();
  if (text.ends_with(kPerSecond)) return text.substr(0, text.size() - kPerSecond.size());
  throw bad_input(place.key(key).where, fmt::format("'{}' is no drift", printable(text)),
                  "the recording's response per second, such as \"1 mN/s\"");
}

/// The place in config.data of the recording that a drift or a rise belongs to.
std::size_t recording_of(const std::string& kind, const Json& j, const FitConfig& config,
                         const DocumentPlace& here) {
  if (j.contains("sets") || j.contains("for")) {
    throw bad_input(here.where, "beside 'sets' or 'for'",
                    fmt::format("a {} of one recording alone", kind));
  }
  const auto of = j.at(kind).at("of").get<std::string>();
  const auto found = std::ranges::find(config.data, of, &DataChoice::dataset);
  if (found == config.data.end() || found->protocol.kind != ProtocolChoice::Kind::measured) {
    throw bad_input(here.key("of").where,
                    fmt::format("'{}' is no recording of this fit", printable(of)),
                    "the name of a recording (protocol 'measured') under /data");
  }
  return static_cast<std::size_t>(found - config.data.begin());
}

/// A linear drift of the zero of one recording.
EstimatedParameter parse_drift(const std::string& name, const Json& j, const FitConfig& config,
                               const DocumentPlace& place) {
  const DocumentPlace here = place.key("drift");
  const std::size_t choice = recording_of("drift", j, config, here);
  const Dimension dimension = reading_dimension(config, config.data[choice]);
  const auto read = [&](const Json& object, std::string_view key, const DocumentPlace& at) {
    return parse_quantity(without_second(object, key, at), dimension, at.key(key).where);
  };
  EstimatedParameter parameter;
  FitParameter& fit = parameter.fit;
  fit.name = name;
  fit.scale = parse_scale(j.value("scale", "linear"), place.key("scale").where);
  fit.unit = per_second(parse_unit(split_quantity(without_second(j, "start", place)).unit,
                                   dimension, place.key("start").where));
  fit.start = read(j, "start", place);
  fit.lower = read(j, "lower", place);
  fit.upper = read(j, "upper", place);
  require_valid(fit, place.where);
  parameter.prior = parse_prior(j, place, read);
  parameter.drift = DriftTerm{choice, quantity_at(j.at("drift"), "origin", Dimension::time, here)};
  return parameter;
}

/// Name, start, bounds and scale of an estimated parameter.
FitParameter parse_search(const std::string& name, const Json& j, Dimension dimension,
                          const DocumentPlace& place) {
  const auto start = j.at("start").get<std::string>();
  FitParameter fit;
  fit.name = name;
  fit.start = quantity_at(j, "start", dimension, place);
  fit.unit = parse_unit(split_quantity(start).unit, dimension, place.key("start").where);
  fit.lower = quantity_at(j, "lower", dimension, place);
  fit.upper = quantity_at(j, "upper", dimension, place);
  const DocumentPlace scale_place = place.key("scale");
  fit.scale = parse_scale(j.value("scale", "log"), scale_place.where);
  require_valid(fit, place.where);
  return fit;
}

/// The delay of a rise of one recording's drive between two samples.
EstimatedParameter parse_rise(const std::string& name, const Json& j, const FitConfig& config,
                              const DocumentPlace& place) {
  const DocumentPlace here = place.key("rise");
  EstimatedParameter parameter;
  parameter.fit = parse_search(name, j, Dimension::time, place);
  if (j.contains("prior")) {
    parameter.prior = parse_prior(
        j, place, [](const Json& object, std::string_view key, const DocumentPlace& at) {
          return quantity_at(object, key, Dimension::time, at);
        });
  }
  const Json& rise = j.at("rise");
  parameter.rise = RiseTerm{recording_of("rise", j, config, here),
                            quantity_at(rise, "begin", Dimension::time, here),
                            quantity_at(rise, "end", Dimension::time, here)};
  if (config.organ) throw bad_input(here.where, "with the model 'organ'", "a law");
  if (parameter.rise->begin_s < parameter.rise->end_s) return parameter;
  throw bad_input(here.key("end").where, "not behind 'begin'", "a later sample");
}

EstimatedParameter parse_parameter(const std::string& name, const Json& j, const Model& model,
                                   const FitConfig& config, const DocumentPlace& place) {
  if (j.contains("drift")) return parse_drift(name, j, config, place);
  if (j.contains("rise")) return parse_rise(name, j, config, place);
  EstimatedParameter parameter;
  const std::vector<std::size_t> scope = parse_scope(j, config, place);
  if (j.contains("sets")) {
    for (const auto& target : j.at("sets")) {
      parameter.sets.push_back(
          {parse_target(target.get<std::string>(), model, place.key("sets")), scope});
    }
  } else {
    parameter.sets.push_back({parse_target(name, model, place), scope});
  }
  const Dimension dimension = model.parameters()[parameter.sets.front().parameter].dimension;
  for (const Target& target : parameter.sets) {
    if (model.parameters()[target.parameter].dimension == dimension) continue;
    throw bad_input(place.key("sets").where, "the parameters set have different dimensions",
                    "parameters of one dimension");
  }
  parameter.fit = parse_search(name, j, dimension, place);
  parameter.prior =
      parse_prior(j, place, [&](const Json& object, std::string_view key, const DocumentPlace& at) {
        return quantity_at(object, key, dimension, at);
      });
  parameter.not_separable = j.value("not_separable", "");
  const FitParameter& fit = parameter.fit;
  for (const Target& target : parameter.sets) {
    const auto [low, high] = model.range(target.parameter);
    if (fit.lower >= low && fit.upper <= high) continue;
    throw bad_input(
        place.key(fit.lower < low ? "lower" : "upper").where,
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
std::vector<std::pair<std::string, Dimension>> noise_parameters(const FitConfig& config,
                                                                const DocumentPlace& place) {
  std::vector<std::pair<std::string, Dimension>> list;
  const auto add = [&](const std::string& name, Dimension dimension) {
    const auto same = [&](const auto& entry) { return entry.first == name; };
    const auto found = std::find_if(list.begin(), list.end(), same);
    if (name.empty()) return;
    if (found == list.end()) {
      list.emplace_back(name, dimension);
    } else if (found->second != dimension) {
      throw bad_input(place.key("data").where,
                      fmt::format("noise parameter '{}' is {} and {}", printable(name),
                                  dimension_name(found->second), dimension_name(dimension)),
                      "one noise parameter for each dimension");
    }
  };
  for (const DataChoice& data : config.data) {
    add(data.sigma_a, reading_dimension(config, data));
    add(data.sigma_b, Dimension::dimensionless);
  }
  return list;
}

/// A noise parameter: as it stands under /parameters, or for the data to decide.
EstimatedParameter parse_noise_parameter(const std::string& name, Dimension dimension,
                                         const Json& parameters, const DocumentPlace& place) {
  EstimatedParameter parameter;
  if (!parameters.contains(name)) {
    parameter.fit.name = name;
    parameter.fit.unit = shown_unit(dimension);
    parameter.from_data = true;
    return parameter;
  }
  const Json& j = parameters.at(name);
  if (j.contains("sets") || j.contains("for") || j.contains("prior")) {
    throw bad_input(place.key(name).where, "'sets', 'for' or 'prior' of a parameter of the noise",
                    "data sets that name it under /noise");
  }
  parameter.fit = parse_search(name, j, dimension, place.key(name));
  if (parameter.fit.lower > 0.0) return parameter;
  throw bad_input(place.key(name).key("lower").where, "not above 0", "a positive lower bound");
}

}  // namespace

void parse_parameters(const Json& document, const Model& model, FitConfig& config,
                      const DocumentPlace& place) {
  const auto of_noise = noise_parameters(config, place);
  const Json& parameters = document.at("parameters");
  for (const auto& [name, j] : parameters.items()) {
    const bool is_noise = std::any_of(of_noise.begin(), of_noise.end(),
                                      [&n = name](const auto& entry) { return entry.first == n; });
    if (is_noise) continue;
    config.parameters.push_back(
        parse_parameter(name, j, model, config, place.key("parameters").key(name)));
  }
  for (const auto& [name, dimension] : of_noise) {
    config.parameters.push_back(
        parse_noise_parameter(name, dimension, parameters, place.key("parameters")));
  }
}

std::vector<double> parse_fixed(const Json& document, const Model& model, const FitConfig& config,
                                const DocumentPlace& place) {
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
  if (!document.contains("fixed")) return values;
  for (const auto& [name, value] : document.at("fixed").items()) {
    const std::size_t target = parse_target(name, model, place.key("fixed"));
    values[target] = parse_quantity(value.get<std::string>(), model.parameters()[target].dimension,
                                    place.key("fixed").key(name).where);
  }
  return values;
}

void require_each_set_once(const FitConfig& config, const Model& model, const Json& document,
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
    if (document.contains("fixed")) {
      for (const auto& [name, value] : document.at("fixed").items()) {
        claim(parse_target(name, model, place.key("fixed")), "fixed");
      }
    }
    for (std::size_t i = 0; i < setter.size(); ++i) {
      if (!setter[i].empty() || !std::isnan(config.fixed[i])) continue;
      throw bad_input(place.where,
                      fmt::format("model parameter '{}' has no value for '{}'",
                                  model.parameters()[i].name, config.data[choice].dataset),
                      "it under /parameters or /fixed");
    }
  }
}

void parse_hypotheses(const Json& list, FitConfig& config, const DocumentPlace& place) {
  std::size_t index = 0;
  for (const auto& j : list) {
    const DocumentPlace here = place.key(std::to_string(index++)).key("values");
    Hypothesis hypothesis;
    hypothesis.name = j.at("name").get<std::string>();
    for (const auto& [name, value] : j.at("values").items()) {
      const FitParameter& p = find_parameter(config, name, here.key(name)).fit;
      const double si =
          parse_quantity(value.get<std::string>(), p.unit.dimension, here.key(name).where);
      if (!(si >= p.lower && si <= p.upper)) {
        throw bad_input(
            here.key(name).where,
            fmt::format("{} is outside the parameter's bounds", value.get<std::string>()),
            "a value within them");
      }
      hypothesis.values.emplace_back(name, si);
    }
    config.hypotheses.push_back(std::move(hypothesis));
  }
}

}  // namespace tpm::fit
