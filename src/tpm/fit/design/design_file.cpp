// Declared in tpm/fit/design/design.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

using ExperimentKind = PlannedExperiment::Kind;

/// More candidates than this are a mistake of the file.
constexpr std::size_t kMostCandidates = 20000;

/// A quantity above 0 (or equal to it, if that is allowed).
double quantity(const Json& value, Dimension dimension, const DocumentPlace& place,
                bool zero_allowed = false) {
  const auto text = value.get<std::string>();
  const double si = parse_quantity(text, dimension, place.where);
  if (si > 0.0 || (zero_allowed && si == 0.0)) return si;
  throw bad_input(place.where, fmt::format("'{}'", printable(text)),
                  zero_allowed ? "0 or more" : "more than 0");
}

std::vector<double> intervals_of(const Json& grid, const DocumentPlace& place) {
  return mapped<double>(grid.at("interval"), [&](const auto& value) {
    return quantity(value, Dimension::time, place.key("interval"));
  });
}

PlannedExperiment planned(const ProtocolBlock& block) {
  if (block.kind == ProtocolKind::creep) {
    return {ExperimentKind::creep, 0.0, 0.0, *block.load_N, *block.duration_s};
  }
  return {ExperimentKind::ramp_hold, *block.depth_m, *block.rate_m_per_s, 0.0, *block.hold_s};
}

/// All combinations; those that differ only in their repeats stand side by side.
void add_grid(const Json& grid, const DocumentPlace& place, std::vector<PlannedExperiment>& list) {
  const bool creep = grid.at("kind") == "creep";
  const std::vector<ProtocolBlock> protocols =
      creep
          ? parse_protocol_lists(grid, place, ProtocolKind::creep, {{"duration", "hold"}},
                                 {"interval", "repeats"})
          : parse_protocol_lists(grid, place, ProtocolKind::ramp_hold, {}, {"interval", "repeats"});
  const auto intervals = intervals_of(grid, place);
  const auto repeats = grid.value("repeats", std::vector<int>{1});
  const std::size_t count = protocols.size() * intervals.size() * repeats.size();
  if (list.size() + count > kMostCandidates) {
    throw bad_input(place.where, fmt::format("{} experiments", list.size() + count),
                    fmt::format("at most {}", kMostCandidates));
  }
  for (const ProtocolBlock& protocol : protocols) {
    for (const double interval : intervals) {
      for (const int repeat : repeats) {
        list.push_back(planned(protocol));
        list.back().interval_s = interval;
        list.back().repeats = repeat;
      }
    }
  }
}

std::vector<PlannedExperiment> parse_grids(const Json& document, const char* key,
                                           const DocumentPlace& place) {
  std::vector<PlannedExperiment> list;
  if (!document.contains(key)) return list;
  std::size_t index = 0;
  for (const auto& grid : document.at(key)) {
    add_grid(grid, place.key(key).key(std::to_string(index++)), list);
  }
  return list;
}

PlannedNoise parse_noise(const Json& j, Dimension dimension, const DocumentPlace& place) {
  return {quantity(j.at("absolute"), dimension, place.key("absolute")), j.value("relative", 0.0)};
}

void parse_noises(const Json& j, DesignProblem& problem, const DocumentPlace& place) {
  problem.force_noise = parse_noise(j.at("force"), Dimension::force, place.key("force"));
  if (j.contains("depth")) {
    problem.depth_noise = parse_noise(j.at("depth"), Dimension::length, place.key("depth"));
  }
  problem.scale_known = j.value("scale", "known") == "known";
  if (j.contains("correlation_time")) {
    problem.correlation_time_s =
        quantity(j.at("correlation_time"), Dimension::time, place.key("correlation_time"), true);
  }
}

void parse_limits(const Json& j, MachineLimits& limits, const DocumentPlace& place) {
  const auto set = [&](const char* key, Dimension dimension, double& limit) {
    if (j.contains(key)) limit = quantity(j.at(key), dimension, place.key(key));
  };
  set("rate", Dimension::speed, limits.rate_m_per_s);
  set("depth", Dimension::length, limits.depth_m);
  set("load", Dimension::force, limits.load_N);
  set("duration", Dimension::time, limits.duration_s);
  set("total_time", Dimension::time, limits.total_s);
  limits.samples = j.value("samples", limits.samples);
}

/// The fit that the design prepares, through the reader of fit configurations.
FitConfig parse_model(const Json& document, const DocumentPlace& place) {
  Json fit{{"title", document.at("title")}};
  for (const char* key : {"model", "law", "tension", "parameters", "fixed"}) {
    if (document.contains(key)) fit[key] = document.at(key);
  }
  fit["data"] = Json::array({{{"dataset", "planned"},
                              {"protocol", {{"kind", "measured"}}},
                              {"noise", {{"kind", "per_row"}}}}});
  FitConfig config = parse_fit_config(fit, place.where);
  if (config.law && config.law->drive != Quantity::indentation_depth) {
    throw bad_input(place.key("law/drive").where, "a stretched strip", "indentation_depth");
  }
  // The search of a simulated fit begins at the true values.
  config.starts = 1;
  config.profiles = false;
  return config;
}

std::size_t parameter_place(const FitConfig& config, const std::string& name,
                            const DocumentPlace& place, std::string_view besides) {
  const std::vector<FitParameter> all = searched_parameters(config);
  const auto found = std::ranges::find(all, name, &FitParameter::name);
  if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
  throw bad_input(place.where, fmt::format("no parameter is called '{}'", printable(name)),
                  fmt::format("{}{}", besides, listed(all, &FitParameter::name)));
}

void separate_nuisance(const Json& document, DesignProblem& problem, const DocumentPlace& place) {
  if (!document.contains("nuisance")) return;
  auto& list = problem.config.parameters;
  for (const auto& name : document.at("nuisance")) {
    const std::size_t i =
        parameter_place(problem.config, name.get<std::string>(), place.key("nuisance"), "one of ");
    problem.nuisance.push_back(list[i]);
    list.erase(list.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (!list.empty()) return;
  throw bad_input(place.key("nuisance").where, "every parameter is a nuisance",
                  "at least one that is not");
}

void require_sizes(const DesignProblem& problem, const DocumentPlace& place) {
  for (const EstimatedParameter& p : problem.config.parameters) {
    if (p.fit.start != 0.0) continue;
    throw bad_input(place.key(fmt::format("parameters/{}/start", p.fit.name)).where,
                    "0 has no relative error", "another value, or the parameter under /nuisance");
  }
}

void parse_known(const Json& document, DesignProblem& problem, const DocumentPlace& place) {
  problem.known.assign(problem.config.parameters.size(), std::numeric_limits<double>::infinity());
  if (!document.contains("known")) return;
  for (const auto& [name, error] : document.at("known").items()) {
    problem.known[parameter_place(problem.config, name, place.key("known"), "one of ")] =
        error.get<double>();
  }
}

void parse_criterion(const Json& document, DesignProblem& problem, const DocumentPlace& place) {
  const std::string criterion = document.value("criterion", "worst");
  if (criterion == "all" || criterion == "worst") {
    problem.criterion = criterion == "all" ? Criterion::all : Criterion::worst;
    return;
  }
  problem.criterion = Criterion::parameter;
  problem.criterion_parameter =
      parameter_place(problem.config, criterion, place.key("criterion"), "all, worst, ");
}

void require_creep_noise(const DesignProblem& problem, const DocumentPlace& place) {
  if (problem.depth_noise) return;
  const auto is_creep = [](const PlannedExperiment& e) { return e.kind == ExperimentKind::creep; };
  if (std::none_of(problem.candidates.begin(), problem.candidates.end(), is_creep) &&
      std::none_of(problem.previous.begin(), problem.previous.end(), is_creep)) {
    return;
  }
  throw bad_input(place.key("noise").where, "creep without the noise of a depth",
                  "it under /noise/depth");
}

}  // namespace

DesignProblem parse_design(const Json& written, std::string_view where) {
  const Json document = checked(written, "design", where);
  const DocumentPlace place{std::string(where)};
  DesignProblem problem;
  problem.config = parse_model(document, place);
  separate_nuisance(document, problem, place);
  require_sizes(problem, place);
  parse_known(document, problem, place);
  parse_noises(document.at("noise"), problem, place.key("noise"));
  if (document.contains("limits")) {
    parse_limits(document.at("limits"), problem.limits, place.key("limits"));
  }
  problem.candidates = parse_grids(document, "candidates", place);
  problem.previous = parse_grids(document, "previous", place);
  require_creep_noise(problem, place);
  parse_criterion(document, problem, place);
  problem.factor = document.value("identified_factor", problem.factor);
  problem.config.level = document.value("level", problem.config.level);
  return problem;
}

DesignProblem read_design(const std::filesystem::path& path) {
  return parse_design(read_json(path), path.string());
}

}  // namespace tpm::fit
