#include "tpm/organ/scene/experiment_blocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr auto kSpringWords = std::to_array<Word<SpringRule>>(
    {{SpringRule::like_the_bonds, "like_the_bonds"}, {SpringRule::equal, "equal"}});

constexpr int kUsualOutputs = 61;
constexpr double kMostOutputs = 100'000;

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
    times.push_back(quantity_of(entry, Dimension::time, here.where));
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

/// Refuses keys of other formulations than the one chosen.
void require_keys_taken(const Json& block, const Formulation& entry, const DocumentPlace& place) {
  for (const auto& [key, value] : block.items()) {
    const bool common = key == "kind" || key == "comparison" || key == "springs";
    if (common || entry.takes(key)) continue;
    throw bad_input(
        place.key(key).where, fmt::format("in the formulation '{}'", entry.name()),
        "it only with \"kind\": " +
            formulations_that([&, &name = key](const Formulation& f) { return f.takes(name); }));
  }
  if (block.value("masses", true)) return;
  for (const char* key : {"damping_ratio", "density_kg_per_m3"}) {
    if (!block.contains(key)) continue;
    throw bad_input(place.key(key).where, "without masses", "\"masses\": true beside it");
  }
}

}  // namespace

const Formulation& FormulationChoice::entry() const {
  const Formulation* found = find_formulation(kind);
  if (found != nullptr) return *found;
  refuse_formulation(kind, "formulation", where,
                     formulations_that([](const Formulation&) { return true; }));
}

FormulationChoice parse_formulation(const Json& block, const DocumentPlace& place) {
  FormulationChoice choice;
  choice.where = place.where;
  choice.kind = block.value("kind", choice.kind);
  const Formulation* entry = find_formulation(choice.kind);
  if (entry == nullptr) {
    refuse_formulation(choice.kind, "formulation", place.key("kind").where,
                       formulations_that([](const Formulation&) { return true; }));
  }
  choice.kind = entry->name();
  if (block.contains("solver")) {
    choice.solver = parse_word(kStiffnessSolverWords, "solver",
                               block.at("solver").get<std::string>(), place.key("solver").where);
  }
  choice.mass_spring = block.contains("comparison");
  if (block.contains("springs") && !choice.mass_spring) {
    throw bad_input(place.key("springs").where, "without a comparison",
                    "springs only with \"comparison\": \"mass_spring\"");
  }
  if (block.contains("springs")) {
    choice.springs = parse_word(kSpringWords, "springs", block.at("springs").get<std::string>(),
                                place.key("springs").where);
  }
  if (block.contains("solver")) {
    choice.solver = parse_word(kStiffnessSolverWords, "solver",
                               block.at("solver").get<std::string>(), place.key("solver").where);
  }
  require_keys_taken(block, *entry, place);
  choice.masses = entry->can().masses && block.value("masses", !entry->takes("masses"));
  const auto number = [&](const char* key, auto& value, double least, double most,
                          const char* expected) {
    value = block.value(key, value);
    if (value >= least && value <= most) return;
    throw bad_input(place.key(key).where, shortest(static_cast<double>(value)), expected);
  };
  number("damping_ratio", choice.damping_ratio, 0.0, 10.0, "0 to 10");
  number("density_kg_per_m3", choice.density_kg_m3, std::numeric_limits<double>::min(),
         std::numeric_limits<double>::max(), "a density above 0");
  number("sweeps", choice.sweeps, 1, 1e6, "1 to 1000000");
  number("exponentials", choice.exponentials, 1, 3, "1 to 3");
  number("rings", choice.rings, 1, 3, "1 to 3");
  if (block.contains("step")) choice.step_s = positive_at(block, "step", Dimension::time, place);
  return choice;
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
  outputs.viscous = wanted("viscous");
  return outputs;
}

}  // namespace tpm::organ
