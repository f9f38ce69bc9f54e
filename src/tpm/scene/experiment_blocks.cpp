#include "tpm/scene/experiment_blocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/core/word_table.hpp"
#include "tpm/scene/blocks.hpp"

namespace tpm {
namespace {

enum class ProtocolKind { ramp_hold, step_hold, creep, knots };

const std::array<KindKeys<ProtocolKind>, 4>& protocol_kinds() {
  static const std::array<KindKeys<ProtocolKind>, 4> kinds{{
      {ProtocolKind::ramp_hold, "ramp_hold", {"depth", "rate", "hold"}, {}},
      {ProtocolKind::step_hold, "step_hold", {"depth", "hold"}, {}},
      {ProtocolKind::creep, "creep", {"load", "duration"}, {}},
      {ProtocolKind::knots, "knots", {"knots"}, {}},
  }};
  return kinds;
}

constexpr auto kFormulationWords =
    std::to_array<Word<FormulationKind>>({{FormulationKind::quasi_static, "quasi_static"},
                                          {FormulationKind::inertial, "inertial"},
                                          {FormulationKind::relaxed, "static"}});
constexpr auto kSpringWords = std::to_array<Word<SpringRule>>(
    {{SpringRule::like_the_bonds, "like_the_bonds"}, {SpringRule::equal, "equal"}});

constexpr int kUsualOutputs = 61;
constexpr double kMostOutputs = 100'000;

double hold_at(const Json& block, const DocumentPlace& place) {
  const double hold = quantity_at(block, "hold", Dimension::time, place);
  if (hold >= 0.0) return hold;
  throw bad_input(place.key("hold").where, fmt::format("{} s", shortest(hold)), "0 s or more");
}

Protocol protocol_of_knots(const Json& list, const DocumentPlace& place) {
  const bool by_depth = list.front().contains("depth");
  const char* key = by_depth ? "depth" : "load";
  std::vector<Knot> knots;
  for (const Json& entry : list) {
    const DocumentPlace here = place.key(std::to_string(knots.size()));
    if (entry.size() != 2 || !entry.contains(key)) {
      throw bad_input(here.where, "is another thing than the first",
                      fmt::format("a time and a {}, as in the first", key));
    }
    knots.push_back(
        {quantity_at(entry, "time", Dimension::time, here),
         quantity_at(entry, key, by_depth ? Dimension::length : Dimension::force, here)});
    if (knots.size() > 1 && knots.back().time_s < knots[knots.size() - 2].time_s) {
      throw bad_input(here.where, "is earlier than the one before", "times that do not fall");
    }
  }
  if (!(knots.back().time_s > knots.front().time_s)) {
    throw bad_input(place.where, "take no time", "a last knot later than the first");
  }
  return {by_depth ? Drive::displacement : Drive::force, std::move(knots), place.where};
}

std::vector<double> even_times(double begin, double end, int count) {
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    times.push_back(count == 1 ? end : begin + (end - begin) * i / (count - 1));
  }
  times.back() = end;
  return times;
}

std::vector<double> listed_times(const Json& list, const Protocol& protocol,
                                 const DocumentPlace& place) {
  std::vector<double> times;
  for (const Json& entry : list) {
    const DocumentPlace here = place.key(std::to_string(times.size()));
    times.push_back(parse_quantity(entry.get<std::string>(), Dimension::time, here.where));
    if (times.back() >= protocol.start_s() && times.back() <= protocol.end_s()) continue;
    throw bad_input(here.where, fmt::format("{} s", shortest(times.back())),
                    fmt::format("a time within the protocol, {} to {} s",
                                shortest(protocol.start_s()), shortest(protocol.end_s())));
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

std::vector<double> spaced_times(double spacing, const Protocol& protocol,
                                 const DocumentPlace& place) {
  const double count = (protocol.end_s() - protocol.start_s()) / spacing;
  if (!(count < kMostOutputs)) {
    throw bad_input(place.where,
                    fmt::format("{} s make {} outputs", shortest(spacing), shortest(count)),
                    fmt::format("at most {}", shortest(kMostOutputs)));
  }
  const auto whole = static_cast<std::size_t>(std::ceil(count * (1.0 - 1e-12)));
  std::vector<double> times;
  times.reserve(whole + 1);
  for (std::size_t i = 0; i < whole; ++i) {
    times.push_back(protocol.start_s() + static_cast<double>(i) * spacing);
  }
  times.push_back(protocol.end_s());
  return times;
}

}  // namespace

std::string_view word_of(FormulationKind kind) {
  return entry_of(kFormulationWords, kind).text;
}

Protocol parse_scene_protocol(const Json& block, const DocumentPlace& place) {
  const auto name = block.at("kind").get<std::string>();
  const KindKeys<ProtocolKind>& kind = *find_entry(protocol_kinds(), name);  // the schema knows it
  require_keys_of(block, kind.text, kind.needed, kind.allowed, place);
  switch (kind.meaning) {
    case ProtocolKind::ramp_hold:
      return ramp_and_hold(positive_at(block, "depth", Dimension::length, place),
                           positive_at(block, "rate", Dimension::speed, place),
                           hold_at(block, place));
    case ProtocolKind::step_hold:
      return step_and_hold(positive_at(block, "depth", Dimension::length, place),
                           positive_at(block, "hold", Dimension::time, place));
    case ProtocolKind::creep:
      return creep(positive_at(block, "load", Dimension::force, place),
                   positive_at(block, "duration", Dimension::time, place));
    case ProtocolKind::knots:
      break;
  }
  return protocol_of_knots(block.at("knots"), place.key("knots"));
}

Formulation parse_formulation(const Json& block, const DocumentPlace& place) {
  Formulation formulation;
  const auto word = [&](const char* key, const auto& words, auto& value) {
    if (!block.contains(key)) return;
    value = parse_word(words, key, block.at(key).get<std::string>(), place.key(key).where);
  };
  word("kind", kFormulationWords, formulation.kind);
  word("springs", kSpringWords, formulation.springs);
  word("solver", kStiffnessSolverWords, formulation.solver);
  if (formulation.inertial() && block.contains("solver")) {
    throw bad_input(place.key("solver").where, "in the formulation 'inertial'",
                    "it only where spheres have no mass");
  }
  formulation.mass_spring = block.contains("comparison");
  if (block.contains("springs") && !formulation.mass_spring) {
    throw bad_input(place.key("springs").where, "without a comparison",
                    "springs only with \"comparison\": \"mass_spring\"");
  }
  for (const char* key : {"damping_ratio", "density_kg_per_m3"}) {
    if (formulation.inertial() || !block.contains(key)) continue;
    throw bad_input(place.key(key).where,
                    fmt::format("in the formulation '{}'", word_of(formulation.kind)),
                    "it only with \"kind\": \"inertial\"");
  }
  formulation.damping_ratio = block.value("damping_ratio", formulation.damping_ratio);
  if (!(formulation.damping_ratio >= 0.0 && formulation.damping_ratio <= 10.0)) {
    throw bad_input(place.key("damping_ratio").where, shortest(formulation.damping_ratio),
                    "0 to 10");
  }
  formulation.density_kg_m3 = block.value("density_kg_per_m3", formulation.density_kg_m3);
  if (!(formulation.density_kg_m3 > 0.0)) {
    throw bad_input(place.key("density_kg_per_m3").where, shortest(formulation.density_kg_m3),
                    "a density above 0");
  }
  return formulation;
}

Outputs parse_outputs(const Json& block, const Protocol& protocol, const DocumentPlace& place) {
  const int ways = static_cast<int>(block.contains("times")) +
                   static_cast<int>(block.contains("count")) +
                   static_cast<int>(block.contains("spacing"));
  if (ways > 1) throw bad_input(place.where, "says when more than once", "times, count or spacing");
  Outputs outputs;
  if (block.contains("times")) {
    outputs.times_s = listed_times(block.at("times"), protocol, place.key("times"));
  } else if (block.contains("spacing")) {
    const double spacing = positive_at(block, "spacing", Dimension::time, place);
    outputs.times_s = spaced_times(spacing, protocol, place.key("spacing"));
  } else {
    outputs.times_s =
        even_times(protocol.start_s(), protocol.end_s(), block.value("count", kUsualOutputs));
  }
  if (!block.contains("fields")) return outputs;
  const auto fields = block.at("fields").get<std::vector<std::string>>();
  const auto wanted = [&](const char* name) {
    return std::find(fields.begin(), fields.end(), name) != fields.end();
  };
  outputs.force = wanted("force");
  outputs.bond_force = wanted("bond_force");
  outputs.remembered = wanted("remembered");
  return outputs;
}

}  // namespace tpm
