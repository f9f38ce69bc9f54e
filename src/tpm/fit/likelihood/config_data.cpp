// Declared in tpm/fit/likelihood/config_parts.hpp.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/fit/likelihood/config_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

using Kind = ProtocolChoice::Kind;
/// The common protocols, and what only data can say. A fit's file gives a common protocol without
/// the numbers that its readings hold.
constexpr auto kProtocolKinds = std::to_array<Word<Kind>>(
    {{Kind::ramp_hold, entry_of(kProtocolKindWords, ProtocolKind::ramp_hold).text},
     {Kind::step_hold, entry_of(kProtocolKindWords, ProtocolKind::step_hold).text},
     {Kind::static_, "static"},
     {Kind::creep, entry_of(kProtocolKindWords, ProtocolKind::creep).text},
     {Kind::measured, "measured"},
     {Kind::oscillation, "oscillation"}});

/// What only oscillations have.
void parse_oscillation(const Json& j, const std::optional<LawSpec>& law, ProtocolChoice& protocol,
                       const DocumentPlace& place) {
  if (protocol.kind != Kind::oscillation) return;
  const DocumentPlace depth = place.key("operating_depth");
  if (!law) {
    throw bad_input(place.key("kind").where, "'oscillation' with the paper's element",
                    "a law of the family under /law");
  }
  if (!j.contains("operating_depth")) return;
  protocol.operating_depth =
      quantity_at(j, "operating_depth", quantity_dimension(law->drive), place);
  if (*protocol.operating_depth >= 0.0) return;
  throw bad_input(depth.where, "below 0", "a depth of the tissue such as \"2 mm\"");
}

ProtocolChoice parse_protocol(const Json& j, const std::optional<LawSpec>& law,
                              const DocumentPlace& place) {
  ProtocolChoice protocol;
  protocol.kind = find_entry(kProtocolKinds, j.at("kind").get<std::string>())->meaning;
  if (protocol.kind == Kind::ramp_hold) {
    protocol.rate_m_per_s = quantity_at(j, "rate", Dimension::speed, place);
    if (j.contains("rate_provenance")) {
      protocol.rate_provenance = parse_provenance(j.at("rate_provenance").get<std::string>(),
                                                  place.key("rate_provenance").where);
    }
  }
  parse_oscillation(j, law, protocol, place);
  return protocol;
}

Selector parse_selector(const Json& j, const DocumentPlace& place) {
  Selector s;
  if (j.contains("depth")) s.depth_m = quantity_at(j, "depth", Dimension::length, place);
  if (j.contains("load")) s.load_N = quantity_at(j, "load", Dimension::force, place);
  if (j.contains("label")) s.label = j.at("label").get<std::string>();
  return s;
}

/// A0/l0 of a spectrum of moduli under a contact.
void parse_stiffness_per_modulus(const Json& j, const FitConfig& config, DataChoice& data,
                                 const DocumentPlace& place) {
  if (!j.contains("stiffness_per_modulus")) return;
  const DocumentPlace here = place.key("stiffness_per_modulus");
  const bool strip = config.law && is_answered_by_stress(config.law->drive);
  if (data.protocol.kind != Kind::oscillation || strip) {
    throw bad_input(
        here.where,
        strip ? "beside a law of stress"
              : fmt::format("beside protocol '{}'", protocol_kind_name(data.protocol.kind)),
        "it only with oscillation and a law of contact force over indentation depth");
  }
  data.stiffness_per_modulus_m = quantity_at(j, "stiffness_per_modulus", Dimension::length, place);
}

/// "imposed": "response" of creep, before what is read in the unit of what answers.
void parse_imposed(const Json& j, const FitConfig& config, DataChoice& data,
                   const DocumentPlace& place) {
  if (!j.contains("imposed")) return;
  const DocumentPlace here = place.key("imposed");
  const auto imposed = j.at("imposed").get<std::string>();
  if (imposed != "drive" && imposed != "response") {
    throw bad_input(here.where, fmt::format("'{}'", printable(imposed)), "drive or response");
  }
  if (imposed == "drive") return;
  const bool answers = config.law && (config.law->drive == Quantity::strain ||
                                      config.law->drive == Quantity::indentation_depth);
  if (data.protocol.kind != Kind::measured || !answers) {
    throw bad_input(here.where,
                    "'response' without a recording of stress over strain or force over depth",
                    "it only with the protocol 'measured' and a law of one of these");
  }
  data.load_imposed = true;
}

/// Limits of the force cell.
void parse_clipping(const Json& j, const FitConfig& config, DataChoice& data,
                    const DocumentPlace& place) {
  for (const auto& [key, limit] :
       {std::pair{"clipped_above", &data.clipped_above}, {"clipped_below", &data.clipped_below}}) {
    if (!j.contains(key)) continue;
    if (data.protocol.kind != Kind::measured) {
      throw bad_input(place.key(key).where, "without a recording",
                      "it only with the protocol 'measured'");
    }
    *limit = quantity_at(j, key, reading_dimension(config, data), place);
  }
}

/// How a recording that has no description is read.
ImportOptions parse_import(const Json& j, const DocumentPlace& place) {
  ImportOptions import;
  for (const auto& [key, value] : j.items()) {
    const DocumentPlace here = place.key(key);
    if (key == "units") {
      for (const auto& [column, unit] : value.items()) {
        set_reading_unit(import, column, unit.get<std::string>(), here.key(column).where);
      }
    } else if (key == "segments") {
      import.segments = value.get<std::vector<std::string>>();
    } else {
      const bool text = value.is_string();
      set_reading_option(import, key, text ? value.get<std::string>() : value.dump(), here.where);
    }
  }
  return import;
}

}  // namespace

DataChoice parse_data(const Json& j, const FitConfig& config, const DocumentPlace& place) {
  DataChoice data;
  data.dataset = j.at("dataset").get<std::string>();
  data.protocol = parse_protocol(j.at("protocol"), config.law, place.key("protocol"));
  parse_stiffness_per_modulus(j, config, data, place);
  parse_imposed(j, config, data, place);
  parse_noise(j.at("noise"), data, reading_dimension(config, data), place.key("noise"));
  if (j.contains("import")) data.import = parse_import(j.at("import"), place.key("import"));
  if (j.contains("from")) data.from_s = quantity_at(j, "from", Dimension::time, place);
  if (j.contains("to")) data.to_s = quantity_at(j, "to", Dimension::time, place);
  parse_clipping(j, config, data, place);
  const bool recording = data.protocol.kind == Kind::measured;
  const bool importable = recording || data.protocol.kind == Kind::oscillation;
  if (!importable && j.contains("import")) {
    throw bad_input(place.where, "'import' for separate readings",
                    "it only with the protocol 'measured' or 'oscillation'");
  }
  if (!recording && (j.contains("from") || j.contains("to"))) {
    throw bad_input(place.where, "'from' or 'to' without a recording",
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

namespace {

/// A limit may have gone through a unit and back.
constexpr double kSameReading = 1e-9;

}  // namespace

bool DataChoice::is_clipped_above(double reading) const {
  return clipped_above && reading >= *clipped_above - kSameReading * std::abs(*clipped_above);
}

bool DataChoice::is_clipped_below(double reading) const {
  return clipped_below && reading <= *clipped_below + kSameReading * std::abs(*clipped_below);
}

std::string_view protocol_kind_name(Kind kind) noexcept {
  return entry_of(kProtocolKinds, kind).text;
}

bool Selector::matches(const Datum& datum) const {
  const auto close = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); };
  if (depth_m && !(datum.depth_m && close(*datum.depth_m, *depth_m))) return false;
  if (load_N && !(datum.load_N && close(*datum.load_N, *load_N))) return false;
  return !label || datum.label == *label;
}

}  // namespace tpm::fit
