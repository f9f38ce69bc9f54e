#include "tpm/organ/scene/experiment_blocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/scene/exponentials.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr auto kSpringWords = std::to_array<Word<SpringRule>>(
    {{SpringRule::like_the_bonds, "like_the_bonds"}, {SpringRule::equal, "equal"}});

constexpr int kUsualOutputs = 61;
constexpr std::size_t kMostTimes = 100'000;
constexpr double kMostOutputs = kMostTimes;

std::vector<double> even_times(double begin, double end, int count) {
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    times.push_back(count == 1 ? end : begin + (end - begin) * i / (count - 1));
  }
  times.back() = end;
  return times;
}

std::vector<double> listed_times(const std::vector<double>& list, const Protocol& protocol,
                                 const DocumentPlace& place) {
  std::vector<double> times;
  for (const double time : list) {
    const DocumentPlace here = place.key(std::to_string(times.size()));
    times.push_back(time);
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

constexpr const char* kSpringsOnly = "springs only with \"comparison\": \"mass_spring\"";
constexpr const char* kMassesOnly = "\"masses\": true beside damping_ratio and density_kg_per_m3";

std::optional<Fault> springs_fault(const FormulationKeys& block) {
  if (!block.springs || block.mass_spring) return std::nullopt;
  return Fault{"springs", "without a comparison"};
}

std::optional<Fault> masses_fault(const FormulationKeys& block) {
  if (block.masses.value_or(true)) return std::nullopt;
  if (block.damping_ratio) return Fault{"damping_ratio", "without masses"};
  if (block.density_kg_m3) return Fault{"density_kg_per_m3", "without masses"};
  return std::nullopt;
}

/// As many as a formulation has.
Key<FormulationKeys> exponentials_key(std::string_view formulation) {
  return with_default(key("exponentials", &FormulationKeys::exponentials,
                          whole<int>(1, most_exponentials(formulation)), "of the contact"),
                      FormulationChoice{}.exponentials);
}

/// The keys that formulations take.
std::vector<Key<FormulationKeys>> settings() {
  using K = FormulationKeys;
  const FormulationChoice usual;
  return {with_default(key("masses", &K::masses, flag(), "spheres have mass"), false),
          with_default(key("damping_ratio", &K::damping_ratio, number({.least = 0.0, .most = 10.0}),
                           "with masses: of the lowest mode"),
                       usual.damping_ratio),
          with_default(key("density_kg_per_m3", &K::density_kg_m3, number(kAboveZero),
                           "with masses: of the spheres"),
                       usual.density_kg_m3),
          with_default(key("step", &K::step_s, quantity(Dimension::time, kAboveZero), "of time"),
                       "1 ms"),
          with_default(key("sweeps", &K::sweeps, whole<int>(1, 1e6), "over the bonds, a step"),
                       usual.sweeps),
          exponentials_key({}),
          with_default(key("solver", &K::solver, word(kStiffnessSolverWords),
                           "how linear systems are solved: by a factorisation, or by conjugate "
                           "gradients with multigrid; automatic counts what the factor takes"),
                       "automatic")};
}

/// The keys that all take: a comparison runs another model on the same spheres.
std::vector<Key<FormulationKeys>> comparison() {
  using K = FormulationKeys;
  static constexpr auto kComparisonWords = std::to_array<Word<bool>>({{true, "mass_spring"}});
  return {key("comparison", &K::mass_spring, word(kComparisonWords),
              "run the mass-spring model on the same spheres instead of the tissue"),
          with_default(key("springs", &K::springs, word(kSpringWords),
                           "mass_spring: how stiff its springs are to each other"),
                       "like_the_bonds")};
}

const Kinds<FormulationKeys, std::string>& formulation_kinds() {
  using K = FormulationKeys;
  static const Kinds<K, std::string> kinds = [] {
    std::vector<Kind<K, std::string>> all;
    const std::vector<Key<K>> known = settings();
    for (const Formulation* f : linked_formulations()) {
      Kind<K, std::string> kind{
          std::string(f->name()), std::string(f->name()), std::string(f->meaning()), {}};
      for (const Key<K>& key : known) {
        if (!f->takes(key.form.name)) continue;
        kind.keys.push_back(key.form.name == "exponentials" ? exponentials_key(f->name()) : key);
      }
      for (const Key<K>& key : comparison()) kind.keys.push_back(key);
      if (!f->also().empty()) {
        all.push_back(kind);
        all.back().word = f->also();
        all.back().sentence = fmt::format("former name of {}", f->name());
      }
      all.push_back(std::move(kind));
    }
    return Kinds<K, std::string>(
        {.name = "formulation", .sentence = "how the response is computed", .may_be_missing = true},
        &K::kind, std::move(all), {{kSpringsOnly, springs_fault}, {kMassesOnly, masses_fault}});
  }();
  return kinds;
}

}  // namespace

const Formulation& FormulationChoice::entry() const {
  const Formulation* found = find_formulation(kind);
  if (found != nullptr) return *found;
  refuse_formulation(kind, "formulation", where,
                     formulations_that([](const Formulation&) { return true; }));
}

ValueType<FormulationKeys> formulation_type() {
  return {shared({.type = Form::Type::later, .made = [] { return formulation_kinds().form(); }}),
          [](const Json& value, const DocumentPlace& place) {
            return formulation_kinds().made(value, place);
          },
          [](const FormulationKeys& block) { return formulation_kinds().write(block); }};
}

FormulationChoice formulation_of(const FormulationKeys& block, const DocumentPlace& place) {
  FormulationChoice choice;
  choice.where = place.where;
  choice.kind = block.kind;
  const Formulation& entry = choice.entry();
  choice.mass_spring = block.mass_spring.has_value();
  choice.springs = block.springs.value_or(choice.springs);
  choice.solver = block.solver.value_or(choice.solver);
  choice.masses = entry.can().masses && block.masses.value_or(!entry.takes("masses"));
  choice.damping_ratio = block.damping_ratio.value_or(choice.damping_ratio);
  choice.density_kg_m3 = block.density_kg_m3.value_or(choice.density_kg_m3);
  choice.sweeps = block.sweeps.value_or(choice.sweeps);
  choice.exponentials = block.exponentials.value_or(choice.exponentials);
  choice.step_s = block.step_s;
  return choice;
}

const Block<OutputKeys>& outputs_block() {
  using K = OutputKeys;
  static constexpr auto kFieldWords =
      std::to_array<Word<OutputField>>({{OutputField::force, "force"},
                                        {OutputField::bond_force, "bond_force"},
                                        {OutputField::viscous, "viscous"}});
  static const Block<K> block(
      "outputs", "when the response is written",
      {key("times", &K::times_s, list(quantity(Dimension::time), {.fewest = 1, .most = kMostTimes}),
           "these times"),
       with_default(key("count", &K::count, whole<int>(1, kMostOutputs),
                        "that many times, evenly, the first and the last instant among them"),
                    kUsualOutputs),
       key("spacing", &K::spacing_s, quantity(Dimension::time, kAboveZero),
           "a time every so often, and the last instant"),
       with_default(key("fields", &K::fields, list(word(kFieldWords), {.distinct = true}),
                        "of the whole network, besides position and displacement"),
                    {"force", "bond_force"})},
      {{"times, count or spacing", [](const K& outputs) -> std::optional<Fault> {
          const int ways = static_cast<int>(outputs.times_s.has_value()) +
                           static_cast<int>(outputs.count.has_value()) +
                           static_cast<int>(outputs.spacing_s.has_value());
          if (ways <= 1) return std::nullopt;
          return Fault{"", "says when more than once"};
        }}});
  return block;
}

Outputs outputs_of(const OutputKeys& block, const Protocol& protocol, const DocumentPlace& place) {
  Outputs outputs;
  if (block.times_s) {
    outputs.times_s = listed_times(*block.times_s, protocol, place.key("times"));
  } else if (block.spacing_s) {
    outputs.times_s = spaced_times(*block.spacing_s, protocol, place.key("spacing"));
  } else {
    outputs.times_s =
        even_times(protocol.start_s(), protocol.end_s(), block.count.value_or(kUsualOutputs));
  }
  if (!block.fields) return outputs;
  const auto wanted = [&](OutputField field) {
    return std::find(block.fields->begin(), block.fields->end(), field) != block.fields->end();
  };
  outputs.force = wanted(OutputField::force);
  outputs.bond_force = wanted(OutputField::bond_force);
  outputs.viscous = wanted(OutputField::viscous);
  return outputs;
}

}  // namespace tpm::organ
