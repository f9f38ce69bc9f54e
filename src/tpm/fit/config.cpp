#include "tpm/fit/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/fit/experiment_refit.hpp"
#include "tpm/law/law_model.hpp"
#include "tpm/material/tpm_element.hpp"

namespace tpm {
namespace {

using Kind = ProtocolChoice::Kind;
constexpr std::array kProtocolKinds{Kind::ramp_hold, Kind::step_hold, Kind::static_,
                                    Kind::creep,     Kind::measured,  Kind::oscillation};

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

std::size_t parse_target(std::string_view name, const Model& model, const Place& place) {
  std::vector<std::string_view> known;
  known.reserve(model.parameters().size());
  for (const ParameterDescription& p : model.parameters()) {
    if (p.name == name) return known.size();
    known.push_back(p.name);
  }
  throw bad_input(place.where, fmt::format("no model parameter is called '{}'", printable(name)),
                  fmt::format("one of {}", fmt::join(known, ", ")));
}

/// The places of the data sets named under "for".
std::vector<std::size_t> parse_scope(const Json& j, const FitConfig& config, const Place& place) {
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

/// Name, start, bounds and scale of an estimated parameter.
FitParameter parse_search(const std::string& name, const Json& j, Dimension dimension,
                          const Place& place) {
  const auto start = j.at("start").get<std::string>();
  const auto unit_begin = start.find_first_of(" \t", start.find_first_not_of(" \t"));
  FitParameter fit;
  fit.name = name;
  fit.start = quantity(j, "start", dimension, place);
  fit.unit = parse_unit(unit_begin == std::string::npos ? std::string{} : start.substr(unit_begin),
                        dimension, place.key("start").where);
  fit.lower = quantity(j, "lower", dimension, place);
  fit.upper = quantity(j, "upper", dimension, place);
  const Place scale_place = place.key("scale");
  fit.scale = parse_scale(j.value("scale", "log"), scale_place.where);
  require_valid(fit, place.where);
  return fit;
}

EstimatedParameter parse_parameter(const std::string& name, const Json& j, const Model& model,
                                   const FitConfig& config, const Place& place) {
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

/// What only oscillations have.
void parse_oscillation(const Json& j, const std::optional<LawSpec>& law, ProtocolChoice& protocol,
                       const Place& place) {
  const Place depth = place.key("operating_depth");
  if (protocol.kind != Kind::oscillation) {
    if (!j.contains("operating_depth")) return;
    throw bad_input(
        depth.where,
        fmt::format("protocol '{}' has no operating depth", protocol_kind_name(protocol.kind)),
        "an operating depth only with oscillation");
  }
  if (!law) {
    throw bad_input(place.key("kind").where, "'oscillation' with the paper's element",
                    "a law of the family under /law");
  }
  if (!j.contains("operating_depth")) return;
  protocol.operating_depth = quantity(j, "operating_depth", quantity_dimension(law->drive), place);
  if (*protocol.operating_depth >= 0.0) return;
  throw bad_input(depth.where, "below 0", "a depth of the tissue such as \"2 mm\"");
}

ProtocolChoice parse_protocol(const Json& j, const std::optional<LawSpec>& law,
                              const Place& place) {
  ProtocolChoice protocol;
  const auto name = j.at("kind").get<std::string>();
  const auto* kind = std::find_if(kProtocolKinds.begin(), kProtocolKinds.end(),
                                  [&](Kind k) { return protocol_kind_name(k) == name; });
  if (kind == kProtocolKinds.end()) {
    throw bad_input(place.key("kind").where, fmt::format("unknown protocol '{}'", printable(name)),
                    "ramp_hold, step_hold, static, creep, measured or oscillation");
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
  parse_oscillation(j, law, protocol, place);
  return protocol;
}

/// The dimension of the readings of a data set, and so of a in sigma = a + b |model|.
Dimension reading_dimension(const FitConfig& config, const DataChoice& data) {
  if (data.protocol.kind == Kind::creep) return Dimension::length;
  const Dimension response =
      config.law ? quantity_dimension(config.law->response) : Dimension::force;
  if (data.protocol.kind != Kind::oscillation) return response;
  const bool modulus = response == Dimension::stress || data.stiffness_per_modulus_m.has_value();
  return modulus ? Dimension::stress : Dimension::stiffness;
}

constexpr std::string_view kEstimated = "estimated";
// Replaced when all data sets are known; nobody calls a parameter that.
constexpr std::string_view kDefaultName = "\n";

/// The name of the noise parameter if "estimated" or "estimated NAME" stands under the key; empty
/// if it holds a number.
std::string estimated_name(const Json& j, std::string_view key) {
  const auto at = j.find(std::string(key));
  if (at == j.end() || !at->is_string()) return {};
  const auto text = at->get<std::string>();
  if (text == kEstimated) return std::string(kDefaultName);
  const std::string before = std::string(kEstimated) + " ";
  return text.starts_with(before) ? text.substr(before.size()) : std::string{};
}

/// `kind`, `distribution` and `degrees_of_freedom`: the law of the noise.
void parse_noise_law(const Json& j, Noise& noise, const Place& place) {
  const std::string distribution = j.value("distribution", "");
  if (distribution == "log_normal") {
    if (j.value("kind", "log") != "log") {
      throw bad_input(place.key("distribution").where, "'log_normal' beside another kind",
                      "no kind, or the kind 'log'");
    }
    noise.kind = NoiseKind::log;
  } else {
    if (!j.contains("kind")) {
      throw bad_input(place.key("kind").where, "is missing",
                      "a noise kind, or the distribution 'log_normal'");
    }
    noise.kind = parse_noise_kind(j.at("kind").get<std::string>(), place.key("kind").where);
    if (!distribution.empty()) {
      noise.shape = parse_error_shape(distribution, place.key("distribution").where);
    }
    if (distribution == "normal" && noise.kind == NoiseKind::log) {
      throw bad_input(place.key("distribution").where, "'normal' beside the kind 'log'",
                      "log_normal");
    }
  }
  if (!j.contains("degrees_of_freedom")) return;
  const Place here = place.key("degrees_of_freedom");
  if (noise.shape != ErrorShape::student_t) {
    throw bad_input(here.where, "without Student's t", "it only with distribution 'student_t'");
  }
  noise.degrees_of_freedom = j.at("degrees_of_freedom").get<double>();
  require_valid(error_law(noise), here.where);
}

/// Throws where sigma cannot be estimated along with the other parameters.
void require_estimable_sigma(const DataChoice& data, const Place& place) {
  if (!data.noise.scale_known && data.noise.shape != ErrorShape::normal) {
    throw bad_input(
        place.key("scale").where,
        fmt::format("estimated under distribution '{}'", error_shape_name(data.noise.shape)),
        "an estimated standard deviation (\"absolute\": \"estimated\") instead");
  }
  if (!data.estimates_sigma()) return;
  if (data.noise.kind == NoiseKind::relative_to_datum) {
    throw bad_input(place.key("relative").where, "estimated under 'relative_to_datum'",
                    "the kind 'relative_to_model' (sigma = b |model|) or 'combined'");
  }
  if (!data.noise.scale_known) {
    throw bad_input(place.key("scale").where, "a common factor and sigma, both estimated",
                    "one of them");
  }
}

/// @param readings dimension of the data
void parse_noise(const Json& j, DataChoice& data, Dimension readings, const Place& place) {
  Noise& noise = data.noise;
  parse_noise_law(j, noise, place);
  const bool needs_relative = uses_relative(noise.kind);
  const bool needs_absolute = uses_absolute(noise.kind);
  for (const auto& [key, needed] : {std::pair<std::string_view, bool>{"relative", needs_relative},
                                    {"absolute", needs_absolute}}) {
    if (j.contains(std::string(key)) == needed) continue;
    throw bad_input(place.where,
                    fmt::format("noise '{}' {} '{}'", noise_kind_name(noise.kind),
                                needed ? "needs" : "does not use", key),
                    needed ? "that key" : "only keys that this kind uses");
  }
  data.sigma_a = estimated_name(j, "absolute");
  data.sigma_b = estimated_name(j, "relative");
  const bool number_relative = needs_relative && data.sigma_b.empty();
  const bool number_absolute = needs_absolute && data.sigma_a.empty();
  if (number_relative && !j.at("relative").is_number()) {
    throw bad_input(place.key("relative").where, "neither a number nor 'estimated'",
                    "a number, \"estimated\" or \"estimated NAME\"");
  }
  if (number_relative) noise.relative = j.at("relative").get<double>();
  if (number_absolute) noise.absolute = quantity(j, "absolute", readings, place);
  if ((number_relative && !(noise.relative > 0.0)) ||
      (number_absolute && !(noise.absolute > 0.0))) {
    throw bad_input(place.where, "a standard deviation that is not above 0", "a positive one");
  }
  noise.scale_known = j.value("scale", "known") == "known";
  require_estimable_sigma(data, place);
}

Selector parse_selector(const Json& j, const Place& place) {
  Selector s;
  if (j.contains("depth")) s.depth_m = quantity(j, "depth", Dimension::length, place);
  if (j.contains("load")) s.load_N = quantity(j, "load", Dimension::force, place);
  if (j.contains("label")) s.label = j.at("label").get<std::string>();
  return s;
}

/// A0/l0 of a spectrum of moduli under a contact.
void parse_stiffness_per_modulus(const Json& j, const FitConfig& config, DataChoice& data,
                                 const Place& place) {
  if (!j.contains("stiffness_per_modulus")) return;
  const Place here = place.key("stiffness_per_modulus");
  const bool strip = config.law && config.law->drive == Quantity::relative_length;
  if (data.protocol.kind != Kind::oscillation || strip) {
    throw bad_input(
        here.where,
        strip ? "beside a law of stress over relative length"
              : fmt::format("beside protocol '{}'", protocol_kind_name(data.protocol.kind)),
        "it only with oscillation and a law of contact force over indentation depth");
  }
  data.stiffness_per_modulus_m = quantity(j, "stiffness_per_modulus", Dimension::length, place);
  if (*data.stiffness_per_modulus_m > 0.0) return;
  throw bad_input(here.where, "not above 0", "A0/l0 such as \"12.56 mm\"");
}

/// The columns and units of a recording that has no description.
ImportOptions parse_import(const Json& j, const Place& place) {
  ImportOptions import;
  import.time_column = j.value("time", "");
  import.drive_column = j.value("drive", "");
  import.response_column = j.value("response", "");
  import.sd_column = j.value("sd", "");
  if (j.contains("drive_quantity")) {
    import.drive_quantity = parse_quantity_name(j.at("drive_quantity").get<std::string>(),
                                                place.key("drive_quantity").where);
  }
  if (j.contains("response_quantity")) {
    import.response_quantity = parse_quantity_name(j.at("response_quantity").get<std::string>(),
                                                   place.key("response_quantity").where);
  }
  if (j.contains("units")) {
    for (const auto& [column, unit] : j.at("units").items()) {
      import.units[column] = unit.get<std::string>();
      static_cast<void>(parse_unit(import.units[column], place.key("units").key(column).where));
    }
  }
  return import;
}

DataChoice parse_data(const Json& j, const FitConfig& config, const Place& place) {
  DataChoice data;
  data.dataset = j.at("dataset").get<std::string>();
  data.protocol = parse_protocol(j.at("protocol"), config.law, place.key("protocol"));
  parse_stiffness_per_modulus(j, config, data, place);
  parse_noise(j.at("noise"), data, reading_dimension(config, data), place.key("noise"));
  if (j.contains("import")) data.import = parse_import(j.at("import"), place.key("import"));
  if (j.contains("from")) data.from_s = quantity(j, "from", Dimension::time, place);
  if (j.contains("to")) data.to_s = quantity(j, "to", Dimension::time, place);
  const bool recording = data.protocol.kind == Kind::measured;
  if (!recording && (j.contains("from") || j.contains("to") || j.contains("import"))) {
    throw bad_input(place.where, "'from', 'to' or 'import' without a recording",
                    "them only with the protocol 'measured'");
  }
  if (!(data.from_s < data.to_s)) {
    throw bad_input(place.key("to").where, "not after 'from'", "a later time");
  }
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

/// Fixed values of all model parameters; NaN where nobody gave one.
std::vector<double> parse_fixed(const Json& document, const Model& model, const FitConfig& config,
                                const Place& place) {
  std::vector<double> values;
  if (config.law) {
    for (const LawParameter& p : law_parameters(*config.law)) {
      values.push_back(p.preset.value_or(std::numeric_limits<double>::quiet_NaN()));
    }
  } else {
    const TpmVector paper = to_vector(TpmParameters{});
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

/// Each model parameter of each data set is set once: by one estimated parameter, or fixed.
void require_each_set_once(const FitConfig& config, const Model& model, const Json& document,
                           const Place& place) {
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

/// Gives the noise parameters without a name of their own one: "sigma_a", "sigma_b", and the data
/// set's name if there are several of them.
void name_noise_parameters(FitConfig& config) {
  const auto several = std::count_if(config.data.begin(), config.data.end(),
                                     [](const DataChoice& d) { return d.estimates_sigma(); }) > 1;
  for (DataChoice& data : config.data) {
    const std::string after = several ? " " + data.dataset : std::string{};
    if (data.sigma_a == kDefaultName) data.sigma_a = "sigma_a" + after;
    if (data.sigma_b == kDefaultName) data.sigma_b = "sigma_b" + after;
  }
}

/// The noise parameters that the data sets name, with their dimensions, each once. Throws
/// Error(bad_input) for a name that stands for two dimensions.
std::vector<std::pair<std::string, Dimension>> noise_parameters(const FitConfig& config,
                                                                const Place& place) {
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
                                         const Json& parameters, const Place& place) {
  EstimatedParameter parameter;
  if (!parameters.contains(name)) {
    parameter.fit.name = name;
    parameter.fit.unit = shown_unit(dimension);
    parameter.from_data = true;
    return parameter;
  }
  const Json& j = parameters.at(name);
  if (j.contains("sets") || j.contains("for")) {
    throw bad_input(place.key(name).where, "'sets' or 'for' of a parameter of the noise",
                    "data sets that name it under /noise");
  }
  parameter.fit = parse_search(name, j, dimension, place.key(name));
  if (parameter.fit.lower > 0.0) return parameter;
  throw bad_input(place.key(name).key("lower").where, "not above 0", "a positive lower bound");
}

/// What is estimated: of the model in the order of the file, then of the noise.
void parse_parameters(const Json& document, const Model& model, FitConfig& config,
                      const Place& place) {
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

/// A robust loss stands for a likelihood that nobody wrote down: nothing that needs one goes with
/// it.
void require_plain_noise_under_loss(const FitConfig& config, const Place& place) {
  if (config.loss.kind == Loss::none) return;
  for (const DataChoice& data : config.data) {
    if (data.noise.shape == ErrorShape::normal && !data.estimates_sigma()) continue;
    throw bad_input(place.key("loss").where,
                    "beside a noise distribution or an estimated standard deviation",
                    "either a loss, or a likelihood such as 'student_t'");
  }
}

BootstrapOptions parse_bootstrap(const Json& j, const FitConfig& config, const Place& place) {
  BootstrapOptions options;
  options.replicates = j.value("replicates", options.replicates);
  options.seed = j.value("seed", config.seed);
  options.level = config.level;
  options.block_length = j.value("block_length", options.block_length);
  options.resampling =
      parse_resampling(j.value("resample", std::string(resampling_name(options.resampling))),
                       place.key("resample").where);
  return options;
}

LawSpec parse_law(const Json& j, const Place& place) {
  LawSpec spec = parse_law_name(j.at("name").get<std::string>(), place.key("name").where);
  const std::string drive = j.value("drive", std::string(quantity_name(spec.drive)));
  spec.drive = parse_quantity_name(drive, place.key("drive").where);
  if (spec.drive == Quantity::relative_length) spec.response = Quantity::stress;
  spec.reference = quantity(j, "reference", quantity_dimension(spec.drive), place);
  require_valid(spec, place.where);
  return spec;
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
    case Kind::oscillation:
      return "oscillation";
  }
  return "";
}

bool Selector::matches(const Datum& datum) const {
  const auto close = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); };
  if (depth_m && !(datum.depth_m && close(*datum.depth_m, *depth_m))) return false;
  if (load_N && !(datum.load_N && close(*datum.load_N, *load_N))) return false;
  return !label || datum.label == *label;
}

bool Target::applies_to(std::size_t choice) const {
  return data.empty() || std::find(data.begin(), data.end(), choice) != data.end();
}

std::unique_ptr<Model> make_model(const FitConfig& config) {
  if (config.law) return std::make_unique<LawModel>(*config.law);
  return make_model(config.model, {config.tension, 1e-10});
}

std::vector<double> model_parameters(const FitConfig& config, std::span<const double> natural,
                                     std::size_t choice) {
  std::vector<double> values = config.fixed;
  for (std::size_t i = 0; i < config.parameters.size(); ++i) {
    for (const Target& target : config.parameters[i].sets) {
      if (target.applies_to(choice)) values[target.parameter] = natural[i];
    }
  }
  return values;
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
  if (document.contains("law")) {
    if (document.contains("model") || document.contains("tension")) {
      throw bad_input(place.key("law").where, "beside 'model' or 'tension'",
                      "either a law of the family or a formulation of the paper's element");
    }
    config.law = parse_law(document.at("law"), place.key("law"));
  }
  std::size_t index = 0;
  for (const auto& j : document.at("data")) {
    config.data.push_back(parse_data(j, config, place.key("data").key(std::to_string(index++))));
  }
  name_noise_parameters(config);
  const std::unique_ptr<Model> model = make_model(config);
  parse_parameters(document, *model, config, place);
  config.fixed = parse_fixed(document, *model, config, place);
  require_each_set_once(config, *model, document, place);
  if (!config.law) {
    TpmVector fixed{};
    std::copy(config.fixed.begin(), config.fixed.end(), fixed.begin());
    require_valid(from_vector(fixed), place.key("fixed").where);
  }
  if (document.contains("loss")) {
    const Json& loss = document.at("loss");
    config.loss.kind = parse_loss(loss.at("kind").get<std::string>(), place.key("loss").where);
    config.loss.width = loss.value("width", config.loss.width);
    require_plain_noise_under_loss(config, place);
  }
  config.adjust_correlation = document.value("correlation", "adjust") == "adjust";
  if (document.contains("starts")) {
    config.starts = document.at("starts").value("count", config.starts);
    config.seed = document.at("starts").value("seed", config.seed);
  }
  if (document.contains("profile")) {
    config.level = document.at("profile").value("level", config.level);
    config.profiles = document.at("profile").value("enabled", true);
  }
  if (document.contains("bootstrap")) {
    config.bootstrap = parse_bootstrap(document.at("bootstrap"), config, place.key("bootstrap"));
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
