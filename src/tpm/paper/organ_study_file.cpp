// Declared in tpm/paper/organ_study.hpp.
// Reading the configuration of a study of the paper's experiments.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tpm/base/text.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpm/paper/organ_study.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

using Kind = ProtocolChoice::Kind;

std::vector<double> positive_list(const Json& object, std::string_view key, Dimension dimension,
                                  const DocumentPlace& place) {
  std::vector<double> values;
  std::size_t index = 0;
  for (const auto& text : object.at(std::string(key))) {
    const DocumentPlace here = place.key(key).key(std::to_string(index++));
    values.push_back(parse_quantity(text.get<std::string>(), dimension, here.where));
    if (!(values.back() > 0.0)) throw bad_input(here.where, "not above 0", "a value above 0");
  }
  return values;
}

std::vector<StudyTissue> parse_tissues(const Json& list, const DocumentPlace& place) {
  std::vector<StudyTissue> tissues;
  std::set<std::string> names;
  for (const auto& j : list) {
    tissues.push_back({j.at("name").get<std::string>(), j.value("scene", "")});
    if (names.insert(tissues.back().name).second) continue;
    throw bad_input(place.where, fmt::format("two tissues '{}'", printable(tissues.back().name)),
                    "a name for each");
  }
  return tissues;
}

/// The configuration of `tpm fit` for one tissue and some of the data.
Json fit_document(const Json& study, const StudyTissue& tissue, const std::string& fit,
                  const Json& data_names, const DocumentPlace& place) {
  Json document{{"title", fmt::format("{}: {}", tissue.name, fit)}};
  document["model"] = tissue.scene.empty() ? "closed_form" : "organ";
  if (!tissue.scene.empty()) document["scene"] = tissue.scene;
  for (const char* key : {"parameters", "fixed", "starts", "profile", "hypotheses"}) {
    if (study.contains(key)) document[key] = study.at(key);
  }
  document["data"] = array_json(data_names, [&](const Json& name) {
    const auto text = name.get<std::string>();
    if (!study.at("data").contains(text)) {
      throw bad_input(place.key("fits").key(fit).where,
                      fmt::format("no data '{}'", printable(text)), "a name under /data");
    }
    return study.at("data").at(text);
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

std::vector<StudyFit> parse_fits(const Json& document, const std::vector<StudyTissue>& tissues,
                                 const DocumentPlace& place, const std::filesystem::path& folder) {
  std::vector<StudyFit> fits;
  for (const auto& [name, data] : document.at("fits").items()) {
    StudyFit fit{name, {}};
    for (const StudyTissue& tissue : tissues) {
      const std::string where =
          fmt::format("{}, fit '{}' of '{}'", place.where, printable(name), printable(tissue.name));
      fit.configs.push_back(
          parse_fit_config(fit_document(document, tissue, name, data, place), where, folder));
      require_paper_protocols(fit.configs.back(), where);
    }
    fits.push_back(std::move(fit));
  }
  return fits;
}

/// What a material holds, checked as a hypothesis of the fit is.
Hypothesis parse_fixed(const Json& hold, const std::string& name, const FitConfig& config,
                       const DocumentPlace& place) {
  Hypothesis fixed{name, {}};
  for (const auto& [parameter, text] : hold.items()) {
    const auto found = std::ranges::find_if(
        config.parameters, [&key = parameter](const auto& p) { return p.fit.name == key; });
    const DocumentPlace here = place.key(parameter);
    if (found == config.parameters.end()) {
      throw bad_input(here.where, "is not estimated", "a name under /parameters");
    }
    const FitParameter& p = found->fit;
    const double value = parse_quantity(text.get<std::string>(), p.unit.dimension, here.where);
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

std::vector<StudyMaterial> parse_materials(const Json& list, const std::vector<StudyFit>& fits,
                                           const DocumentPlace& place) {
  std::vector<StudyMaterial> materials;
  std::set<std::string> names;
  std::size_t index = 0;
  for (const auto& j : list) {
    const DocumentPlace here = place.key(std::to_string(index++));
    const auto fit_name = j.at("fit").get<std::string>();
    const auto fit = std::ranges::find(fits, fit_name, &StudyFit::name);
    if (fit == fits.end()) {
      throw bad_input(here.key("fit").where, fmt::format("no fit '{}'", printable(fit_name)),
                      "a name under /fits");
    }
    StudyMaterial material{
        j.at("name").get<std::string>(), static_cast<std::size_t>(fit - fits.begin()), {}};
    if (!names.insert(material.name).second) {
      throw bad_input(here.key("name").where, "another material has it", "a name for each");
    }
    if (j.contains("fixed")) {
      material.fixed =
          parse_fixed(j.at("fixed"), material.name, fit->configs.front(), here.key("fixed"));
    }
    materials.push_back(std::move(material));
  }
  return materials;
}

StudyCondition parse_static(const Json& j, const DocumentPlace& place) {
  StudyCondition c;
  c.depth_m = positive_at(j, "depth", Dimension::length, place);
  c.read_m = positive_list(j, "readings", Dimension::length, place);
  if (*std::max_element(c.read_m.begin(), c.read_m.end()) > c.depth_m) {
    throw bad_input(place.key("readings").where, "deeper than 'depth'", "depths of the curve");
  }
  return c;
}

std::vector<StudyCondition> parse_conditions(const Json& j, const DocumentPlace& place) {
  std::vector<StudyCondition> conditions;
  if (j.contains("static")) {
    conditions.push_back(parse_static(j.at("static"), place.key("static")));
  }
  if (j.contains("relaxation")) {
    const Json& r = j.at("relaxation");
    const DocumentPlace here = place.key("relaxation");
    StudyCondition c;
    c.kind = Kind::ramp_hold;
    c.duration_s = positive_at(r, "hold", Dimension::time, here);
    for (const double depth : positive_list(r, "depths", Dimension::length, here)) {
      for (const double rate : positive_list(r, "rates", Dimension::speed, here)) {
        c.depth_m = depth;
        c.rate_m_per_s = rate;
        conditions.push_back(c);
      }
    }
  }
  if (j.contains("creep")) {
    const Json& r = j.at("creep");
    const DocumentPlace here = place.key("creep");
    StudyCondition c;
    c.kind = Kind::creep;
    c.duration_s = positive_at(r, "duration", Dimension::time, here);
    for (const double load : positive_list(r, "loads", Dimension::force, here)) {
      c.load_N = load;
      conditions.push_back(c);
    }
  }
  return conditions;
}

}  // namespace

OrganStudyConfig parse_organ_study(const Json& written, std::string_view where,
                                   const std::filesystem::path& folder) {
  const Json document = checked(written, "organ_experiments", where);
  const DocumentPlace place{std::string(where)};
  OrganStudyConfig config;
  config.title = document.at("title").get<std::string>();
  config.description = document.value("description", "");
  config.tissues = parse_tissues(document.at("tissues"), place.key("tissues"));
  config.fits = parse_fits(document, config.tissues, place, folder);
  config.materials = parse_materials(document.at("materials"), config.fits, place.key("materials"));
  config.conditions = parse_conditions(document.at("conditions"), place.key("conditions"));
  return config;
}

OrganStudyConfig read_organ_study(const std::filesystem::path& path) {
  return parse_organ_study(read_json(path), path.string(), path.parent_path());
}

}  // namespace tpm::paper
