#include "tpmkit/law_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm {
using namespace base;
using namespace files;

using namespace files;

namespace {

const char* reference_key(const LawSpec& spec) {
  return is_answered_by_stress(spec.drive) ? "reference" : "reference_m";
}

const char* fitted_to_key(const LawSpec& spec) {
  return is_answered_by_stress(spec.drive) ? "fitted_to" : "fitted_to_m";
}

LawSpec spec_of(const Json& json, std::string_view where) {
  LawSpec spec = parse_law_name(json.at("law").get<std::string>(), where);
  spec.drive = parse_quantity_name(json.at("drive").get<std::string>(), where);
  spec.response = parse_quantity_name(json.at("response").get<std::string>(), where);
  const char* key = reference_key(spec);
  if (!json.contains(key)) throw bad_input(where, fmt::format("no key '{}'", key), "the reference");
  spec.reference = json.at(key).get<double>();
  require_valid(spec, where);
  return spec;
}

void require_known_keys(const Json& values, const std::vector<LawParameter>& parameters,
                        std::string_view where) {
  std::vector<std::string> known;
  known.reserve(parameters.size());
  for (const LawParameter& p : parameters) known.push_back(law_key(p));
  for (const auto& [key, value] : values.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    throw bad_input(
        where, fmt::format("unknown parameter '{}'{}", printable(key), did_you_mean(key, known)),
        fmt::format("one of {}", fmt::join(known, ", ")));
  }
}

std::vector<double> values_of(const Json& values, const LawSpec& spec, std::string_view where) {
  const std::vector<LawParameter> parameters = law_parameters(spec);
  require_known_keys(values, parameters, where);
  std::vector<double> result;
  result.reserve(parameters.size());
  for (const LawParameter& p : parameters) {
    const std::string key = law_key(p);
    if (values.contains(key)) {
      result.push_back(values.at(key).get<double>());
    } else if (p.preset) {
      result.push_back(*p.preset);
    } else {
      throw bad_input(where, fmt::format("no parameter '{}'", key), p.meaning);
    }
  }
  return result;
}

}  // namespace

std::string law_key(const LawParameter& parameter) {
  std::string unit(si_symbol(parameter.dimension));
  if (unit.empty()) return parameter.name;
  if (const auto slash = unit.find('/'); slash != std::string::npos) {
    unit.replace(slash, 1, "_per_");
  }
  return parameter.name + "_" + unit;
}

LawFile files::law_from_json(const Json& written, std::string_view where) {
  const Json json = checked(written, "law", where);
  LawFile law;
  law.spec = spec_of(json, where);
  law.values = values_of(json.at("parameters"), law.spec, where);
  try {
    LawModel(law.spec).require_in_range(law.values);
  } catch (const Error& error) {
    throw error.within(where);
  }
  law.provenance = parse_provenance(json.at("provenance").get<std::string>(), where);
  law.note = json.value("note", "");
  if (const char* key = fitted_to_key(law.spec); json.contains(key)) {
    law.fitted_to = json.at(key).get<double>();
  }
  if (json.contains("adequacy")) {
    const Json& stated = json.at("adequacy");
    law.adequacy = LawAdequacy{.verdict = stated.at("verdict").get<std::string>(),
                               .residual_over_noise = {},
                               .words = stated.at("words").get<std::string>(),
                               .causes = stated.value("causes", std::vector<std::string>{})};
    if (stated.contains("residual_over_noise")) {
      law.adequacy->residual_over_noise = stated.at("residual_over_noise").get<double>();
    }
  }
  if (json.contains("fit")) {
    law.uncertainty =
        uncertainty_from_json(json.at("fit"), law.spec, law.values, fmt::format("{}: fit", where));
  }
  return law;
}

Json files::to_json(const LawFile& law) {
  Json json{{"law", law_name(law.spec)},
            {"drive", quantity_name(law.spec.drive)},
            {"response", quantity_name(law.spec.response)},
            {reference_key(law.spec), law.spec.reference}};
  Json values = Json::object();
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (std::isfinite(law.values[i])) values[law_key(parameters[i])] = law.values[i];
  }
  json["parameters"] = std::move(values);
  json["provenance"] = provenance_name(law.provenance);
  if (law.fitted_to) json[fitted_to_key(law.spec)] = *law.fitted_to;
  if (!law.note.empty()) json["note"] = law.note;
  if (law.adequacy) json["adequacy"] = to_json(*law.adequacy);
  if (law.uncertainty) json["fit"] = to_json(*law.uncertainty, law.spec);
  return json;
}

LawFile read_law(const std::filesystem::path& path) {
  return law_from_json(read_json(path), path.string());
}

void write_law(const std::filesystem::path& path, const LawFile& law) {
  write_file(path, to_text(to_json(law)));
}

}  // namespace tpm
