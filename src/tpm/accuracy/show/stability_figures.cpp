// Declared in tpm/accuracy/show/stability_report.hpp.
#include <fmt/format.h>

#include "tpm/accuracy/show/stability_report.hpp"

namespace tpm::accuracy {
namespace {

/// Maps that stand side by side.
struct MapPair {
  std::string name, first, second;
};

const std::vector<MapPair>& pairs() {
  static const std::vector<MapPair> list{{"rest", "relaxation_time", "depth"},
                                         {"motion", "stiffness", "mass"},
                                         {"rates", "load_rate", "damping"}};
  return list;
}

const StabilityMap* map_of(const StabilityStudy& study, const std::string& id, StepRule rule) {
  for (const StabilityMap& map : study.maps) {
    if (map.id == id && map.rule == rule) return &map;
  }
  return nullptr;
}

Panel map_panel(const StabilityMap& map) {
  Panel panel{.title = fmt::format("{}: step against {}", step_rule_name(map.rule), map.quantity),
              .x = {map.quantity, map.unit, true},
              .y = {"step", "s", true}};
  for (const StabilityClassEntry& entry : kStabilityClasses) {
    Series found{
        .kind = Series::Kind::points, .label = std::string(entry.text), .provenance = "model"};
    for (const StabilityPoint& p : map.points) {
      if (p.verdict.found != entry.meaning) continue;
      found.add(p.x, p.step_s);
    }
    if (!found.x.empty()) panel.series.push_back(std::move(found));
  }
  if (!map.limit_x.empty()) {
    panel.series.push_back(line("limit of linear theory", map.limit_x, map.limit_step_s));
  }
  return panel;
}

}  // namespace

std::vector<Figure> stability_figures(const StabilityStudy& study) {
  std::vector<Figure> figures;
  for (const StepRuleEntry& entry : kStepRules) {
    if (entry.adaptive) continue;
    for (const MapPair& pair : pairs()) {
      const StabilityMap* first = map_of(study, pair.first, entry.meaning);
      const StabilityMap* second = map_of(study, pair.second, entry.meaning);
      if (first == nullptr || second == nullptr) continue;
      const bool limited = !first->limit_x.empty() || !second->limit_x.empty();
      Figure figure{
          fmt::format("{}_{}", step_rule_name(entry.meaning), pair.name),
          fmt::format("{}: where it fails", step_rule_name(entry.meaning)),
          fmt::format(
              "(a) {}. (b) {}. Runs of 300 steps (with a rising load: 300 after it), compared over "
              "the last 32.{}",
              first->problem, second->problem,
              limited ? "" : " Linear theory gives this rule no limit here.")};
      figure.panels = {map_panel(*first), map_panel(*second)};
      figures.push_back(std::move(figure));
    }
  }
  return figures;
}

}  // namespace tpm::accuracy
