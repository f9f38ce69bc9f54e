// Declared in tpm/fit/likelihood/config_parts.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/fit/likelihood/config_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

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
void parse_noise_law(const Json& j, Noise& noise, const DocumentPlace& place) {
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
  const DocumentPlace here = place.key("degrees_of_freedom");
  if (noise.shape != ErrorShape::student_t) {
    throw bad_input(here.where, "without Student's t", "it only with distribution 'student_t'");
  }
  noise.degrees_of_freedom = j.at("degrees_of_freedom").get<double>();
  require_valid(error_law(noise), here.where);
}

/// Throws where sigma cannot be estimated along with the other parameters.
void require_estimable_sigma(const DataChoice& data, const DocumentPlace& place) {
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

}  // namespace

Dimension reading_dimension(const FitConfig& config, const DataChoice& data) {
  if (data.protocol.kind == ProtocolChoice::Kind::creep) return Dimension::length;
  if (data.load_imposed) return quantity_dimension(config.law->drive);
  const Dimension response =
      config.law ? quantity_dimension(config.law->response) : Dimension::force;
  if (data.protocol.kind != ProtocolChoice::Kind::oscillation) return response;
  const bool modulus = response == Dimension::stress || data.stiffness_per_modulus_m.has_value();
  return modulus ? Dimension::stress : Dimension::stiffness;
}

void parse_noise(const Json& j, DataChoice& data, Dimension readings, const DocumentPlace& place) {
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
  if (number_absolute) noise.absolute = quantity_at(j, "absolute", readings, place);
  if ((number_relative && !(noise.relative > 0.0)) ||
      (number_absolute && !(noise.absolute > 0.0))) {
    throw bad_input(place.where, "a standard deviation that is not above 0", "a positive one");
  }
  noise.scale_known = j.value("scale", "known") == "known";
  require_estimable_sigma(data, place);
}

void name_noise_parameters(FitConfig& config) {
  const auto several = std::ranges::count_if(config.data, &DataChoice::estimates_sigma) > 1;
  for (DataChoice& data : config.data) {
    const std::string after = several ? " " + data.dataset : std::string{};
    if (data.sigma_a == kDefaultName) data.sigma_a = "sigma_a" + after;
    if (data.sigma_b == kDefaultName) data.sigma_b = "sigma_b" + after;
  }
}

}  // namespace tpm::fit
