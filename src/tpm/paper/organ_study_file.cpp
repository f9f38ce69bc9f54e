// Declared in tpm/paper/organ_study.hpp.
// Reading the configuration of a study of the paper's experiments.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tpm/base/text.hpp"
#include "tpm/files/keys/block.hpp"
#include "tpm/paper/organ_study.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

using Kind = ProtocolChoice::Kind;

/// Value of a key of tpm fit, whose reader reads it.
ValueType<Json> of_fit(Form::Type type, std::size_t fewest = 0) {
  ValueType<Json> read = any("as of tpm fit");
  Form form{.type = type, .fewest = fewest, .item = read.form};
  read.form = shared(std::move(form));
  return read;
}

const Block<StudyTissue>& tissue_block() {
  static const Block<StudyTissue> block(
      "tissue", "a tissue that the experiments are done on",
      {required(key("name", &StudyTissue::name, text(), "its name")),
       key("scene", &StudyTissue::scene, text(),
           "the file that holds the organ, its bonds and anchors, relative to this file; without "
           "it "
           "the star of the paper by its closed form")});
  return block;
}

struct MaterialKeys {
  std::string name, fit;
  std::vector<std::pair<std::string, std::string>> fixed;
};

const Block<MaterialKeys>& study_material_block() {
  static const Block<MaterialKeys> block(
      "study_material",
      "what all tissues are compared at: the first tissue's fit, with parameters fixed if so "
      "wished",
      {required(key("name", &MaterialKeys::name, text(), "its name")),
       required(key("fit", &MaterialKeys::fit, text(), "name of a fit")),
       key("fixed", &MaterialKeys::fixed, map_of(text(), 1),
           "quantities at which estimated parameters are fixed while the others are fitted")});
  return block;
}

struct ExperimentKeys {
  double depth_m = 0.0, hold_s = 0.0, duration_s = 0.0;
  std::vector<double> readings_m, depths_m, rates_m_per_s, loads_N;
};

ValueType<double> positive(Dimension dimension) {
  return quantity(dimension, kAboveZero);
}
ValueType<std::vector<double>> positives(Dimension dimension) {
  return list(positive(dimension), {.fewest = 1});
}

const Block<ExperimentKeys>& static_block() {
  using K = ExperimentKeys;
  static const Block<K> block(
      "static", "the force over the depth, long after each step",
      {required(key("depth", &K::depth_m, positive(Dimension::length),
                    "the curve goes from 0 to this indentation depth")),
       required(
           key("readings", &K::readings_m, positives(Dimension::length), "depths of the tables"))},
      {{"readings within the depth of the curve", [](const K& keys) -> std::optional<Fault> {
          const auto& all = keys.readings_m;
          if (*std::max_element(all.begin(), all.end()) <= keys.depth_m) return std::nullopt;
          return Fault{"readings", "deeper than 'depth'"};
        }}});
  return block;
}

const Block<ExperimentKeys>& relaxation_block() {
  using K = ExperimentKeys;
  static const Block<K> block(
      "relaxation", "ramps that are held, in all combinations",
      {required(key("depths", &K::depths_m, positives(Dimension::length), "indentation depths")),
       required(key("rates", &K::rates_m_per_s, positives(Dimension::speed), "of the ramps")),
       required(key("hold", &K::hold_s, positive(Dimension::time), "after each ramp"))});
  return block;
}

const Block<ExperimentKeys>& creep_block() {
  using K = ExperimentKeys;
  static const Block<K> block(
      "creep", "loads that are kept",
      {required(key("loads", &K::loads_N, positives(Dimension::force), "applied as steps")),
       required(key("duration", &K::duration_s, positive(Dimension::time), "of each load"))});
  return block;
}

struct ConditionKeys {
  std::optional<ExperimentKeys> static_, relaxation, creep;
};

const Block<ConditionKeys>& conditions_block() {
  using K = ConditionKeys;
  static const Block<K> block(
      "conditions", "the experiments of which curves are computed",
      {key("static", &K::static_, static_block().type(), "static indentation"),
       key("relaxation", &K::relaxation, relaxation_block().type(), "relaxation"),
       key("creep", &K::creep, creep_block().type(), "creep")},
      {{"static, relaxation or creep", [](const K& keys) -> std::optional<Fault> {
          if (keys.static_ || keys.relaxation || keys.creep) return std::nullopt;
          return Fault{"", "names no experiment"};
        }}});
  return block;
}

struct StudyKeys {
  std::string title, description;
  std::vector<StudyTissue> tissues;
  Json parameters, fixed, data, starts, profile, hypotheses;
  std::vector<std::pair<std::string, std::vector<std::string>>> fits;
  std::vector<MaterialKeys> materials;
  ConditionKeys conditions;
};

const Block<StudyKeys>& study_block() {
  using K = StudyKeys;
  using Type = Form::Type;
  static const Block<K> block(
      "organ_experiments", "",
      {required(with_example(key("title", &K::title, text(), "what the study is"),
                             "Static indentation of the star")),
       key("description", &K::description, text(), "what else is to be said of it"),
       required(with_example(key("tissues", &K::tissues, list(tissue_block().type(), {.fewest = 1}),
                                 "the first is what the others are compared with"),
                             Json::array({Json{{"name", "star"}}}))),
       required(with_example(key("parameters", &K::parameters, of_fit(Type::map, 1),
                                 "as of tpm fit; the same for every tissue"),
                             {{"E",
                               {{"start", "12 kPa"},
                                {"lower", "1 kPa"},
                                {"upper", "200 kPa"},
                                {"sets", {"E1", "E2", "Eprime"}}}}})),
       key("fixed", &K::fixed, of_fit(Type::map), "as of tpm fit"),
       required(
           with_example(key("data", &K::data, of_fit(Type::map, 1),
                            "a name and a data set with its protocol and noise, as of tpm fit"),
                        {{"static",
                          {{"dataset", "evren_static"},
                           {"protocol", {{"kind", "static"}}},
                           {"noise", {{"kind", "relative_to_datum"}, {"relative", 0.1}}}}}})),
       required(with_example(
           key("fits", &K::fits, map_of(list(text(), {.fewest = 1, .distinct = true}), 1),
               "a name and the names of the data that are fitted together"),
           Json{{"static", Json::array({"static"})}})),
       key("starts", &K::starts, of_fit(Type::map), "as of tpm fit"),
       key("profile", &K::profile, of_fit(Type::map), "as of tpm fit"),
       key("hypotheses", &K::hypotheses, of_fit(Type::list), "as of tpm fit, tested in every fit"),
       required(with_example(
           key("materials", &K::materials, list(study_material_block().type(), {.fewest = 1}),
               "what all tissues are compared at"),
           Json::array({Json{{"name", "fitted"}, {"fit", "static"}}}))),
       required(with_example(
           key("conditions", &K::conditions, conditions_block().type(),
               "the experiments of which curves are computed"),
           {{"static", {{"depth", "8 mm"}, {"readings", Json::array({"2 mm", "8 mm"})}}}}))});
  return block;
}

void require_names_once(const std::vector<StudyTissue>& tissues, const DocumentPlace& place) {
  std::set<std::string> names;
  for (const StudyTissue& tissue : tissues) {
    if (names.insert(tissue.name).second) continue;
    throw bad_input(place.where, fmt::format("two tissues '{}'", printable(tissue.name)),
                    "a name for each");
  }
}

/// The configuration of `tpm fit` for one tissue and some of the data.
Json fit_document(const StudyKeys& study, const StudyTissue& tissue, const std::string& fit,
                  const std::vector<std::string>& data_names, const DocumentPlace& place) {
  Json document{{"title", fmt::format("{}: {}", tissue.name, fit)}};
  document["model"] = tissue.scene.empty() ? "closed_form" : "organ";
  if (!tissue.scene.empty()) document["scene"] = tissue.scene;
  const auto pass_on = [&](const char* key, const Json& value) {
    if (!value.is_null()) document[key] = value;
  };
  pass_on("parameters", study.parameters);
  pass_on("fixed", study.fixed);
  pass_on("starts", study.starts);
  pass_on("profile", study.profile);
  pass_on("hypotheses", study.hypotheses);
  document["data"] = array_json(data_names, [&](const std::string& name) {
    if (!study.data.contains(name)) {
      throw bad_input(place.key("fits").key(fit).where,
                      fmt::format("no data '{}'", printable(name)), "a name under /data");
    }
    return study.data.at(name);
  });
  return document;
}

/// Curves are those of the paper's experiments: nothing else has its figures.
void require_paper_protocols(const FitConfig& config, std::string_view where) {
  for (const DataChoice& data : config.data) {
    const Kind kind = data.protocol.kind;
    if (kind == Kind::ramp_hold || kind == Kind::static_ || kind == Kind::creep) continue;
    throw bad_input(where, fmt::format("protocol '{}'", protocol_kind_name(kind)),
                    "ramp_hold, static or creep");
  }
}

std::vector<StudyFit> fits_of(const StudyKeys& study, const DocumentPlace& place,
                              const std::filesystem::path& folder) {
  std::vector<StudyFit> fits;
  for (const auto& [name, data] : study.fits) {
    StudyFit fit{name, {}};
    for (const StudyTissue& tissue : study.tissues) {
      const std::string where =
          fmt::format("{}, fit '{}' of '{}'", place.where, printable(name), printable(tissue.name));
      fit.configs.push_back(
          parse_fit_config(fit_document(study, tissue, name, data, place), where, folder));
      require_paper_protocols(fit.configs.back(), where);
    }
    fits.push_back(std::move(fit));
  }
  return fits;
}

/// Parameters that a material fixes, checked as a hypothesis of the fit is.
Hypothesis fixed_of(const MaterialKeys& material, const FitConfig& config,
                    const DocumentPlace& place) {
  Hypothesis fixed{material.name, {}};
  for (const auto& [parameter, text] : material.fixed) {
    const auto found = std::ranges::find_if(
        config.parameters, [&key = parameter](const auto& p) { return p.fit.name == key; });
    const DocumentPlace here = place.key(parameter);
    if (found == config.parameters.end()) {
      throw bad_input(here.where, "is not estimated", "a name under /parameters");
    }
    const FitParameter& p = found->fit;
    const double value = parse_quantity(text, p.unit.dimension, here.where);
    if (!(value >= p.lower && value <= p.upper)) {
      throw bad_input(here.where, "outside the parameter's bounds", "a value within them");
    }
    fixed.values.emplace_back(parameter, value);
  }
  if (fixed.values.size() == config.parameters.size()) {
    throw bad_input(place.where, "all parameters are fixed", "at least one that is fitted");
  }
  return fixed;
}

std::vector<StudyMaterial> materials_of(const std::vector<MaterialKeys>& list,
                                        const std::vector<StudyFit>& fits,
                                        const DocumentPlace& place) {
  std::vector<StudyMaterial> materials;
  std::set<std::string> names;
  for (const MaterialKeys& keys : list) {
    const DocumentPlace here = place.key(std::to_string(materials.size()));
    const auto fit = std::ranges::find(fits, keys.fit, &StudyFit::name);
    if (fit == fits.end()) {
      throw bad_input(here.key("fit").where, fmt::format("no fit '{}'", printable(keys.fit)),
                      "a name under /fits");
    }
    StudyMaterial material{keys.name, static_cast<std::size_t>(fit - fits.begin()), {}};
    if (!names.insert(material.name).second) {
      throw bad_input(here.key("name").where, "another material has it", "a name for each");
    }
    if (!keys.fixed.empty()) {
      material.fixed = fixed_of(keys, fit->configs.front(), here.key("fixed"));
    }
    materials.push_back(std::move(material));
  }
  return materials;
}

std::vector<StudyCondition> conditions_of(const ConditionKeys& keys) {
  std::vector<StudyCondition> conditions;
  if (keys.static_) {
    conditions.push_back({.depth_m = keys.static_->depth_m, .read_m = keys.static_->readings_m});
  }
  if (keys.relaxation) {
    for (const double depth : keys.relaxation->depths_m) {
      for (const double rate : keys.relaxation->rates_m_per_s) {
        conditions.push_back({.kind = Kind::ramp_hold,
                              .depth_m = depth,
                              .rate_m_per_s = rate,
                              .duration_s = keys.relaxation->hold_s,
                              .read_m = {}});
      }
    }
  }
  if (keys.creep) {
    for (const double load : keys.creep->loads_N) {
      conditions.push_back({.kind = Kind::creep,
                            .load_N = load,
                            .duration_s = keys.creep->duration_s,
                            .read_m = {}});
    }
  }
  return conditions;
}

}  // namespace

const FileKind& organ_study_kind() {
  static const FileKind kind{
      "organ_experiments", "Configuration of tpm paper experiments",
      "Tissues, the data that each is fitted to, and the experiments whose curves are computed. "
      "What "
      "stands under parameters, fixed, data, starts, profile and hypotheses has the form of the "
      "configuration of tpm fit",
      study_block().form()};
  return kind;
}

OrganStudyConfig parse_organ_study(const Json& written, std::string_view where,
                                   const std::filesystem::path& folder) {
  const DocumentPlace place{std::string(where)};
  const StudyKeys keys = study_block().made(checked(written, organ_study_kind(), where), place);
  require_names_once(keys.tissues, place.key("tissues"));
  OrganStudyConfig config;
  config.title = keys.title;
  config.description = keys.description;
  config.tissues = keys.tissues;
  config.fits = fits_of(keys, place, folder);
  config.materials = materials_of(keys.materials, config.fits, place.key("materials"));
  config.conditions = conditions_of(keys.conditions);
  return config;
}

OrganStudyConfig read_organ_study(const std::filesystem::path& path) {
  return parse_organ_study(read_json(path), path.string(), path.parent_path());
}

}  // namespace tpm::paper
