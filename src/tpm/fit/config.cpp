#include "tpm/fit/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"

namespace tpm {
namespace {

using Kind = ProtocolChoice::Kind;
constexpr std::array kProtocolKinds{Kind::ramp_hold, Kind::step_hold, Kind::static_, Kind::creep,
                                    Kind::measured};

/// A place in the document, for messages.
struct Place {
  std::string where;
  [[nodiscard]] Place key(std::string_view name) const {
    return {where.find(": key ") == std::string::npos ? fmt::format("{}: key /{}", where, name)
                                                      : fmt::format("{}/{}", where, name)};
  }
};

double quantity(const Json& object, std::string_view key, Dimension dimension, const Place& place) {
  return parse_quantity(object.at(std::string(key)).get<std::string>(), dimension,
                        place.key(key).where);
}

TpmIndex parse_target(std::string_view name, const Place& place) {
  for (std::size_t i = 0; i < kTpmParameterTable.size(); ++i) {
    if (kTpmParameterTable[i].name == name) return static_cast<TpmIndex>(i);
  }
  std::vector<std::string_view> known;
  known.reserve(kTpmParameterTable.size());
  for (const auto& description : kTpmParameterTable) known.push_back(description.name);
  throw bad_input(place.where, fmt::format("no model parameter is called '{}'", printable(name)),
                  fmt::format("one of {}", fmt::join(known, ", ")));
}

EstimatedParameter parse_parameter(const std::string& name, const Json& j, const Place& place) {
  EstimatedParameter parameter;
  if (j.contains("sets")) {
    for (const auto& target : j.at("sets")) {
      parameter.sets.push_back(parse_target(target.get<std::string>(), place.key("sets")));
    }
  } else {
    parameter.sets.push_back(parse_target(name, place));
  }
  const Dimension dimension =
      kTpmParameterTable[static_cast<std::size_t>(parameter.sets.front())].dimension;
  for (const TpmIndex target : parameter.sets) {
    if (kTpmParameterTable[static_cast<std::size_t>(target)].dimension == dimension) continue;
    throw bad_input(place.key("sets").where, "the parameters set have different dimensions",
                    "parameters of one dimension");
  }
  const auto start = j.at("start").get<std::string>();
  const auto unit_begin = start.find_first_of(" \t", start.find_first_not_of(" \t"));
  FitParameter& fit = parameter.fit;
  fit.name = name;
  fit.start = quantity(j, "start", dimension, place);
  fit.unit = parse_unit(unit_begin == std::string::npos ? std::string{} : start.substr(unit_begin),
                        dimension, place.key("start").where);
  fit.lower = quantity(j, "lower", dimension, place);
  fit.upper = quantity(j, "upper", dimension, place);
  const Place scale_place = place.key("scale");
  fit.scale = parse_scale(j.value("scale", "log"), scale_place.where);
  require_valid(fit, place.where);
  if (!(fit.lower >= 0.0)) {
    throw bad_input(place.key("lower").where, "negative", "a bound of at least 0");
  }
  return parameter;
}

ProtocolChoice parse_protocol(const Json& j, const Place& place) {
  ProtocolChoice protocol;
  const auto name = j.at("kind").get<std::string>();
  const auto* kind = std::find_if(kProtocolKinds.begin(), kProtocolKinds.end(),
                                  [&](Kind k) { return protocol_kind_name(k) == name; });
  if (kind == kProtocolKinds.end()) {
    throw bad_input(place.key("kind").where, fmt::format("unknown protocol '{}'", printable(name)),
                    "ramp_hold, step_hold, static, creep or measured");
  }
  protocol.kind = *kind;
  if (protocol.kind == Kind::ramp_hold) {
    if (!j.contains("rate")) throw bad_input(place.where, "no rate", "a rate such as \"4 mm/s\"");
    protocol.rate_m_per_s = quantity(j, "rate", Dimension::speed, place);
    if (!(protocol.rate_m_per_s > 0.0)) {
      throw bad_input(place.key("rate").where, "not above 0", "a rate such as \"4 mm/s\"");
    }
    if (j.contains("rate_provenance")) {
      protocol.rate_provenance = parse_provenance(j.at("rate_provenance").get<std::string>(),
                                                  place.key("rate_provenance").where);
    }
  } else if (j.contains("rate")) {
    throw bad_input(place.key("rate").where, fmt::format("protocol '{}' has no rate", name),
                    "a rate only with ramp_hold");
  }
  return protocol;
}

/// "0.01 N" or "0.1 mm": an absolute standard deviation, of the dimension of the datum.
double absolute_sigma(const Json& j, const Place& place) {
  const auto text = j.at("absolute").get<std::string>();
  const auto unit_begin = text.find_first_of(" \t");
  const std::string unit =
      unit_begin == std::string::npos ? std::string{} : text.substr(unit_begin);
  const Dimension dimension = parse_unit(unit, place.key("absolute").where).dimension;
  if (dimension != Dimension::force && dimension != Dimension::length) {
    throw bad_input(place.key("absolute").where, fmt::format("'{}'", printable(text)),
                    "a force or a length");
  }
  return quantity(j, "absolute", dimension, place);
}

Noise parse_noise(const Json& j, const Place& place) {
  Noise noise;
  noise.kind = parse_noise_kind(j.at("kind").get<std::string>(), place.key("kind").where);
  const bool needs_relative = noise.kind == NoiseKind::relative_to_datum ||
                              noise.kind == NoiseKind::combined || noise.kind == NoiseKind::log ||
                              noise.kind == NoiseKind::relative_to_model;
  const bool needs_absolute =
      noise.kind == NoiseKind::absolute || noise.kind == NoiseKind::combined;
  for (const auto& [key, needed] : {std::pair<std::string_view, bool>{"relative", needs_relative},
                                    {"absolute", needs_absolute}}) {
    if (j.contains(std::string(key)) == needed) continue;
    throw bad_input(place.where,
                    fmt::format("noise '{}' {} '{}'", noise_kind_name(noise.kind),
                                needed ? "needs" : "does not use", key),
                    needed ? "that key" : "only keys that this kind uses");
  }
  if (needs_relative) noise.relative = j.at("relative").get<double>();
  if (needs_absolute) noise.absolute = absolute_sigma(j, place);
  if ((needs_relative && !(noise.relative > 0.0)) || (needs_absolute && !(noise.absolute > 0.0))) {
    throw bad_input(place.where, "a standard deviation that is not above 0", "a positive one");
  }
  noise.scale_known = j.value("scale", "known") == "known";
  return noise;
}

Selector parse_selector(const Json& j, const Place& place) {
  Selector s;
  if (j.contains("depth")) s.depth_m = quantity(j, "depth", Dimension::length, place);
  if (j.contains("load")) s.load_N = quantity(j, "load", Dimension::force, place);
  if (j.contains("label")) s.label = j.at("label").get<std::string>();
  return s;
}

DataChoice parse_data(const Json& j, const Place& place) {
  DataChoice data;
  data.dataset = j.at("dataset").get<std::string>();
  data.protocol = parse_protocol(j.at("protocol"), place.key("protocol"));
  data.noise = parse_noise(j.at("noise"), place.key("noise"));
  for (const auto& [key, list] :
       {std::pair{"exclude", &data.exclude}, {"hold_out", &data.hold_out}}) {
    if (!j.contains(key)) continue;
    for (const auto& selector : j.at(key)) {
      list->push_back(parse_selector(selector, place.key(key)));
    }
  }
  return data;
}

const EstimatedParameter& find_parameter(const FitConfig& config, const std::string& name,
                                         const Place& place) {
  for (const EstimatedParameter& p : config.parameters) {
    if (p.fit.name == name) return p;
  }
  throw bad_input(place.where, fmt::format("'{}' is not an estimated parameter", printable(name)),
                  "a name from /parameters");
}

void parse_hypotheses(const Json& list, FitConfig& config, const Place& place) {
  std::size_t index = 0;
  for (const auto& j : list) {
    const Place here = place.key(std::to_string(index++)).key("values");
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

void refuse_double_assignment(const FitConfig& config, const Json& document, const Place& place) {
  std::array<std::string, kTpmParameterCount> setter;
  const auto claim = [&](TpmIndex target, const std::string& by) {
    std::string& owner = setter[static_cast<std::size_t>(target)];
    if (!owner.empty()) {
      throw bad_input(
          place.where,
          fmt::format("model parameter '{}' is set by '{}' and by '{}'",
                      kTpmParameterTable[static_cast<std::size_t>(target)].name, owner, by),
          "each model parameter set once");
    }
    owner = by;
  };
  for (const EstimatedParameter& p : config.parameters) {
    for (const TpmIndex target : p.sets) claim(target, p.fit.name);
  }
  if (!document.contains("fixed")) return;
  for (const auto& [name, value] : document.at("fixed").items()) {
    claim(parse_target(name, place.key("fixed")), "fixed");
  }
}

TpmParameters parse_fixed(const Json& document, const Place& place) {
  TpmVector values = to_vector(TpmParameters{});
  if (document.contains("fixed")) {
    for (const auto& [name, value] : document.at("fixed").items()) {
      const auto target = static_cast<std::size_t>(parse_target(name, place.key("fixed")));
      values[target] =
          parse_quantity(value.get<std::string>(), kTpmParameterTable[target].dimension,
                         place.key("fixed").key(name).where);
    }
  }
  const TpmParameters fixed = from_vector(values);
  require_valid(fixed, place.key("fixed").where);
  return fixed;
}

}  // namespace

std::string_view protocol_kind_name(Kind kind) noexcept {
  switch (kind) {
    case Kind::ramp_hold:
      return "ramp_hold";
    case Kind::step_hold:
      return "step_hold";
    case Kind::static_:
      return "static";
    case Kind::creep:
      return "creep";
    case Kind::measured:
      return "measured";
  }
  return "";
}

bool Selector::matches(const Datum& datum) const {
  const auto close = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); };
  if (depth_m && !(datum.depth_m && close(*datum.depth_m, *depth_m))) return false;
  if (load_N && !(datum.load_N && close(*datum.load_N, *load_N))) return false;
  return !label || datum.label == *label;
}

FitConfig parse_fit_config(const Json& document, std::string_view where) {
  check_schema(document, "fit", where);
  const Place place{std::string(where)};
  FitConfig config;
  config.title = document.at("title").get<std::string>();
  config.model = document.value("model", config.model);
  if (document.value("tension", "exact") == "frozen_at_peak") {
    config.tension = TensionRule::frozen_at_peak();
  }
  for (const auto& [name, j] : document.at("parameters").items()) {
    config.parameters.push_back(parse_parameter(name, j, place.key("parameters").key(name)));
  }
  config.fixed = parse_fixed(document, place);
  refuse_double_assignment(config, document, place);
  std::size_t index = 0;
  for (const auto& j : document.at("data")) {
    config.data.push_back(parse_data(j, place.key("data").key(std::to_string(index++))));
  }
  if (document.contains("loss")) {
    const Json& loss = document.at("loss");
    config.loss.kind = parse_loss(loss.at("kind").get<std::string>(), place.key("loss").where);
    config.loss.width = loss.value("width", config.loss.width);
  }
  if (document.contains("starts")) {
    config.starts = document.at("starts").value("count", config.starts);
    config.seed = document.at("starts").value("seed", config.seed);
  }
  if (document.contains("profile")) {
    config.level = document.at("profile").value("level", config.level);
    config.profiles = document.at("profile").value("enabled", true);
  }
  if (document.contains("hypotheses")) {
    parse_hypotheses(document.at("hypotheses"), config, place.key("hypotheses"));
  }
  const bool known = config.data.front().noise.scale_known;
  for (const DataChoice& data : config.data) {
    if (data.noise.scale_known == known) continue;
    throw bad_input(place.key("data").where, "some noise scales are known and others estimated",
                    "all known or all estimated");
  }
  return config;
}

FitConfig read_fit_config(const std::filesystem::path& path) {
  FitConfig config = parse_fit_config(read_json(path), path.string());
  config.folder = path.parent_path();
  return config;
}

}  // namespace tpm
