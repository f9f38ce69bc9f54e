// Declared in tpm/fit/design/design.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/keys/placed.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

using ExperimentKind = PlannedExperiment::Kind;

/// More candidates than this are a mistake of the file.
constexpr std::size_t kMostCandidates = 20000;

/// All combinations of what a file lists.
struct GridKeys {
  ProtocolKind kind = ProtocolKind::ramp_hold;
  ProtocolLists lists;
  std::vector<double> intervals_s;
  std::vector<int> repeats{1};
  DocumentPlace place = {};
};

std::vector<Key<GridKeys>> grid_keys(ProtocolKind kind,
                                     std::initializer_list<ProtocolKeyName> renamed) {
  using K = GridKeys;
  std::vector<Key<K>> keys;
  for (const Key<ProtocolLists>& one : protocol_list_keys(kind, renamed)) {
    keys.push_back(within(&K::lists, one));
  }
  keys.push_back(
      required(with_example(key("interval", &K::intervals_s,
                                list(files::quantity(Dimension::time, kAboveZero), {.fewest = 1}),
                                "between samples, from the first moment on"),
                            Json::array({"0.1 s"}))));
  keys.push_back(key("repeats", &K::repeats, list(whole<int>(1, 1000), {.fewest = 1}),
                     "recordings on fresh sites; default [1]"));
  return keys;
}

const Kinds<GridKeys, ProtocolKind>& grid_kinds() {
  using Kind = ProtocolKind;
  static const Kinds<GridKeys, Kind> kinds(
      {"grid", "experiments: every combination of what is listed"}, &GridKeys::kind,
      {{Kind::ramp_hold, "ramp_hold", "a ramp that is held", grid_keys(Kind::ramp_hold, {})},
       {Kind::creep, "creep", "a load as a step", grid_keys(Kind::creep, {{"duration", "hold"}})}});
  return kinds;
}

const Block<PlannedNoise>& noise_block(Dimension dimension) {
  using N = PlannedNoise;
  const auto of = [](const char* name, Dimension unit) {
    return Block<N>(
        name, "scatter of a reading",
        {required(with_example(
             key("absolute", &N::absolute, files::quantity(unit, kAboveZero), "of every reading"),
             unit == Dimension::force ? "5 mN" : "0.01 mm")),
         key("relative", &N::relative, number({.least = 0.0, .most = 10.0}),
             "share of the expected reading that is added")});
  };
  static const Block<N> force = of("force_noise", Dimension::force);
  static const Block<N> depth = of("depth_noise", Dimension::length);
  return dimension == Dimension::force ? force : depth;
}

struct DesignKeys {
  std::string title;
  Json model, law, tension, parameters, fixed;  ///< of the fit, whose reader reads them
  std::vector<Placed<std::string>> nuisance;
  std::vector<std::pair<std::string, Placed<double>>> known;
  PlannedNoise force;
  std::optional<PlannedNoise> depth;
  bool scale_known = true;
  double correlation_time_s = 0.0;
  MachineLimits limits;
  std::vector<GridKeys> candidates, previous;
  Placed<std::string> criterion{"worst", {}};
  double factor = 2.0, level = FitConfig{}.level;
};

const Block<DesignKeys>& planned_noise_block() {
  using K = DesignKeys;
  static const Block<K> block(
      "planned_noise", "scatter of the readings",
      {required(key("force", &K::force, noise_block(Dimension::force).type(), "of a force")),
       key("depth", &K::depth, noise_block(Dimension::length).type(), "of a depth: of creep"),
       key("scale", &K::scale_known, word(kNoiseScaleWords),
           "estimated: right up to one factor, intervals from Student's t"),
       key("correlation_time", &K::correlation_time_s,
           files::quantity(Dimension::time, kZeroOrMore),
           "of the noise; 0 s: independent samples")});
  return block;
}

const Block<MachineLimits>& limits_block() {
  using L = MachineLimits;
  const auto limit = [](const char* name, double L::*member, Dimension dimension,
                        const char* sentence, Json usual = nullptr) {
    return with_default(key(name, member, files::quantity(dimension, kAboveZero), sentence),
                        std::move(usual));
  };
  static const Block<L> block(
      "limits", "what the machine and the tissue bear",
      {limit("rate", &L::rate_m_per_s, Dimension::speed, "of a ramp"),
       limit("depth", &L::depth_m, Dimension::length, "damage of liver", "12 mm"),
       limit("load", &L::load_N, Dimension::force, "of creep"),
       limit("duration", &L::duration_s, Dimension::time, "of one recording"),
       limit("total_time", &L::total_s, Dimension::time, "of all repeats"),
       key("samples", &L::samples, whole<double>(1, 1e6), "of one recording")});
  return block;
}

/// Of the fit, in the forms that a design takes.
FormPtr planned_parameters_form() {
  const FormPtr quantity_text = text(1).form;
  return map_form(
      object_form("planned_parameter", "a parameter, at the value taken as true",
                  {required_key("start", quantity_text, "the value taken as true"),
                   required_key("lower", quantity_text, "least value"),
                   required_key("upper", quantity_text, "largest value"),
                   optional_key("scale", one_of({"log", "linear", "inverse_square"}).form,
                                "coordinate of the search; default log"),
                   optional_key("sets", list(text(1), {.fewest = 1, .distinct = true}).form,
                                "model parameters that take this value; default: the one of the "
                                "same name")}),
      1);
}

FormPtr planned_law_form() {
  return object_form(
      "planned_law", "a law of the family instead of the paper's element",
      {required_key("name", text(1).form,
                    "kernel, branches, tension: linear-1-elastic, power-2, hertz-fzener"),
       optional_key("drive", one_of({"indentation_depth"}).form,
                    "answered by a contact force; default indentation_depth"),
       required_key("reference", text(1).form, "reference depth of the kernel, such as \"5 mm\"")});
}

const Block<DesignKeys>& design_block() {
  using K = DesignKeys;
  const auto grid = placed(grid_kinds().type(), &GridKeys::place);
  static const Block<K> block(
      "design", "",
      {required(key("title", &K::title, text(), "what the design is")),
       unread<K>("description", text().form, "what else is to be said of it"),
       key("model", &K::model, as_json(one_of({"closed_form", "cvodes"}).form),
           "default closed_form"),
       key("law", &K::law, as_json(planned_law_form()),
           "a law of the family instead of the paper's element; its parameters are listed by tpm "
           "laws NAME"),
       key("tension", &K::tension, as_json(one_of({"exact", "frozen_at_peak"}).form),
           "exact: lambda1(e); frozen_at_peak: as the paper; default exact"),
       required(
           with_example(key("parameters", &K::parameters, as_json(planned_parameters_form()),
                            "as in a fit; start is the value taken as true"),
                        {{"E1", {{"start", "12 kPa"}, {"lower", "1 kPa"}, {"upper", "200 kPa"}}}})),
       key("fixed", &K::fixed, as_json(map_form(text(1).form)),
           "model parameters fixed at a value; what is neither estimated nor fixed has the paper's "
           "value (with a law: contact and offset 0, spacing infinite)"),
       key("nuisance", &K::nuisance, list(placed(text(1)), {.distinct = true}),
           "parameters of which every recording has its own, such as an offset"),
       key("known", &K::known, map_of(placed(number({.least = 1e-6, .most = 1e6}))),
           "relative standard errors known beforehand, such as {\"E1\": 0.3}"),
       required(members("noise", planned_noise_block(), "scatter of the readings")),
       key("limits", &K::limits, limits_block().type(), "of machine and tissue"),
       required(key("candidates", &K::candidates, list(grid, {.fewest = 1}),
                    "grids: every combination is a candidate")),
       key("previous", &K::previous, list(grid),
           "experiments already done, every combination once: their information is added"),
       with_default(key("criterion", &K::criterion, placed(text()),
                        "worst, all, or the name of a parameter"),
                    "worst"),
       key("identified_factor", &K::factor, number({.least = 1.000001, .most = 1e6}),
           "identified: the interval reaches no further than value / factor and value * factor"),
       key("level", &K::level, number({.least = 0.01, .most = 0.9999}), "of the intervals")},
      {{"the noise of a depth beside creep (/noise/depth)",
        [](const K& keys) -> std::optional<Fault> {
          const auto is_creep = [](const GridKeys& g) { return g.kind == ProtocolKind::creep; };
          const bool creep = std::ranges::any_of(keys.candidates, is_creep) ||
                             std::ranges::any_of(keys.previous, is_creep);
          if (!creep || keys.depth) return std::nullopt;
          return Fault{"noise", "creep without the noise of a depth"};
        }}});
  return block;
}

PlannedExperiment planned(const ProtocolBlock& block) {
  if (block.kind == ProtocolKind::creep) {
    return {ExperimentKind::creep, 0.0, 0.0, *block.load_N, *block.duration_s};
  }
  return {ExperimentKind::ramp_hold, *block.depth_m, *block.rate_m_per_s, 0.0, *block.hold_s};
}

/// All combinations; those that differ only in their repeats stand side by side.
void add_grid(const GridKeys& grid, std::vector<PlannedExperiment>& experiments) {
  const auto protocols = combinations(grid.kind, grid.lists, grid.place);
  const std::size_t count = protocols.size() * grid.intervals_s.size() * grid.repeats.size();
  if (experiments.size() + count > kMostCandidates) {
    throw bad_input(grid.place.where, fmt::format("{} experiments", experiments.size() + count),
                    fmt::format("at most {}", kMostCandidates));
  }
  for (const ProtocolBlock& protocol : protocols) {
    for (const double interval : grid.intervals_s) {
      for (const int repeat : grid.repeats) {
        experiments.push_back(planned(protocol));
        experiments.back().interval_s = interval;
        experiments.back().repeats = repeat;
      }
    }
  }
}

std::vector<PlannedExperiment> experiments_of(const std::vector<GridKeys>& grids) {
  std::vector<PlannedExperiment> experiments;
  for (const GridKeys& grid : grids) add_grid(grid, experiments);
  return experiments;
}

/// The fit that the design prepares, through the reader of fit configurations.
FitConfig parse_model(const DesignKeys& keys, const DocumentPlace& place) {
  Json fit{{"title", keys.title}};
  const auto pass_on = [&](const char* key, const Json& value) {
    if (!value.is_null()) fit[key] = value;
  };
  pass_on("model", keys.model);
  pass_on("law", keys.law);
  pass_on("tension", keys.tension);
  pass_on("parameters", keys.parameters);
  pass_on("fixed", keys.fixed);
  fit["data"] = Json::array({{{"dataset", "planned"},
                              {"protocol", {{"kind", "measured"}}},
                              {"noise", {{"kind", "per_row"}}}}});
  FitConfig config = parse_fit_config(fit, place.where);
  // The search of a simulated fit begins at the true values.
  config.starts = 1;
  config.profiles = false;
  return config;
}

std::size_t parameter_place(const FitConfig& config, const std::string& name,
                            const DocumentPlace& place, std::string_view besides = "one of ") {
  const std::vector<FitParameter> all = searched_parameters(config);
  const auto found = std::ranges::find(all, name, &FitParameter::name);
  if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
  const auto names = mapped<std::string>(all, &FitParameter::name);
  throw bad_input(
      place.where,
      fmt::format("no parameter is called '{}'{}", printable(name), did_you_mean(name, names)),
      fmt::format("{}{}", besides, fmt::join(names, ", ")));
}

void separate_nuisance(const DesignKeys& keys, DesignProblem& problem) {
  auto& list = problem.config.parameters;
  for (const auto& [name, place] : keys.nuisance) {
    const std::size_t i = parameter_place(problem.config, name, place);
    problem.nuisance.push_back(list[i]);
    list.erase(list.begin() + static_cast<std::ptrdiff_t>(i));
    if (!list.empty()) continue;
    throw bad_input(place.where, "every parameter is a nuisance", "at least one that is not");
  }
}

void require_sizes(const DesignProblem& problem, const DocumentPlace& place) {
  for (const EstimatedParameter& p : problem.config.parameters) {
    if (p.fit.start != 0.0) continue;
    throw bad_input(place.key(fmt::format("parameters/{}/start", p.fit.name)).where,
                    "0 has no relative error", "another value, or the parameter under /nuisance");
  }
}

void set_known(const DesignKeys& keys, DesignProblem& problem) {
  problem.known.assign(problem.config.parameters.size(), std::numeric_limits<double>::infinity());
  for (const auto& [name, error] : keys.known) {
    problem.known[parameter_place(problem.config, name, error.place)] = error.value;
  }
}

void set_criterion(const DesignKeys& keys, DesignProblem& problem) {
  const auto& [criterion, place] = keys.criterion;
  if (criterion == "all" || criterion == "worst") {
    problem.criterion = criterion == "all" ? Criterion::all : Criterion::worst;
    return;
  }
  problem.criterion = Criterion::parameter;
  problem.criterion_parameter = parameter_place(problem.config, criterion, place, "all, worst, ");
}

}  // namespace

const FileKind& design_kind() {
  static const FileKind kind{
      "design", "Design of tpm design",
      "Which experiments could be done, and what is taken as true. Quantities are texts of a "
      "number and a unit, such as \"12 kPa\"",
      design_block().form()};
  return kind;
}

DesignProblem parse_design(const Json& written, std::string_view where) {
  const DocumentPlace place{std::string(where)};
  const DesignKeys keys = design_block().made(checked(written, design_kind(), where), place);
  DesignProblem problem;
  problem.config = parse_model(keys, place);
  separate_nuisance(keys, problem);
  require_sizes(problem, place);
  set_known(keys, problem);
  problem.force_noise = keys.force;
  problem.depth_noise = keys.depth;
  problem.scale_known = keys.scale_known;
  problem.correlation_time_s = keys.correlation_time_s;
  problem.limits = keys.limits;
  problem.candidates = experiments_of(keys.candidates);
  problem.previous = experiments_of(keys.previous);
  set_criterion(keys, problem);
  problem.factor = keys.factor;
  problem.config.level = keys.level;
  return problem;
}

DesignProblem read_design(const std::filesystem::path& path) {
  return parse_design(read_json(path), path.string());
}

}  // namespace tpm::fit
