#include "tpmkit/law_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/data/curve_words.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm {
using namespace files;

namespace {

const char* reference_key(const LawSpec& spec) {
  return is_answered_by_stress(spec.drive) ? "reference" : "reference_m";
}

const char* fitted_to_key(const LawSpec& spec) {
  return is_answered_by_stress(spec.drive) ? "fitted_to" : "fitted_to_m";
}

struct LawKeys {
  std::string law, note;
  LawSpec spec;  ///< of drive and response
  std::optional<double> reference_m, reference, fitted_to_m, fitted_to;
  std::vector<std::pair<std::string, double>> parameters;
  Provenance provenance = Provenance::assumed;
  std::optional<LawAdequacy> adequacy;
  Json fit;
};

const Block<LawAdequacy>& adequacy_block() {
  using A = LawAdequacy;
  static const Block<A> block(
      "law_adequacy",
      "whether the law describes the data: the residual against the noise where nothing moves",
      {required(key("verdict", &A::verdict, one_of({"adequate", "not_described", "not_judged"}),
                    "in a word")),
       key("residual_over_noise", &A::residual_over_noise, number(kZeroOrMore),
           "ratio of standard deviations, of the worst recording"),
       required(key("summary", &A::summary, text(1), "in a sentence")),
       key("causes", &A::causes, list(remark()),
           "likely ones, where the law does not describe the data")});
  return block;
}

const Block<LawKeys>& law_block() {
  using K = LawKeys;
  const auto of_spec = [](const Key<LawSpec>& one) { return within(&K::spec, one); };
  static const Block<K> block(
      "law", "",
      {required(with_example(
           key("law", &K::law, text(1), "the name, such as 'linear-2-elastic' or 'hertz-fzener'"),
           "linear-1")),
       required(of_spec(key("drive", &LawSpec::drive,
                            quantity_among({Quantity::indentation_depth, Quantity::strain,
                                            Quantity::relative_length}),
                            "what is imposed"))),
       required(of_spec(key("response", &LawSpec::response,
                            quantity_among({Quantity::contact_force, Quantity::stress}),
                            "what answers"))),
       with_example(key("reference_m", &K::reference_m, number(kAboveZero),
                        "the reference depth of an indentation"),
                    0.001),
       key("reference", &K::reference, number(kAboveZero),
           "the reference of a stretched strip, a relative length"),
       required(with_example(
           key("parameters", &K::parameters, map_of(number(), 1),
               "each parameter in SI by its name and unit, such as k_inf_N_per_m, tau1_s, alpha; "
               "spacing, contact and offset may be left out"),
           {{"k_inf_N_per_m", 20.0}, {"k1_N_per_m", 30.0}, {"tau1_s", 1.5}})),
       key("fitted_to_m", &K::fitted_to_m, number(kAboveZero),
           "largest depth of the data that the law was fitted to, from the contact point"),
       key("fitted_to", &K::fitted_to, number(kAboveZero),
           "the same of a stretched strip, a relative length beyond the slack"),
       required(with_example(
           key("provenance", &K::provenance, word(kProvenances), "where the parameters come from"),
           "assumed")),
       key("note", &K::note, text_if_any(), "anything else worth knowing"),
       key("adequacy", &K::adequacy, adequacy_block().type(), "whether the law describes the data"),
       key("fit", &K::fit, as_json(uncertainty_form()),
           "what the fit knows about the parameters")});
  return block;
}

LawSpec spec_of(const LawKeys& keys, std::string_view where) {
  LawSpec spec = parse_law_name(keys.law, where);
  spec.drive = keys.spec.drive;
  spec.response = keys.spec.response;
  const bool strip = is_answered_by_stress(spec.drive);
  const std::optional<double>& reference = strip ? keys.reference : keys.reference_m;
  if (!reference) {
    throw bad_input(where, fmt::format("no key '{}'", reference_key(spec)), "the reference");
  }
  spec.reference = *reference;
  require_valid(spec, where);
  return spec;
}

using NamedValues = std::vector<std::pair<std::string, double>>;

void require_known_keys(const NamedValues& values, const std::vector<LawParameter>& parameters,
                        std::string_view where) {
  std::vector<std::string> known;
  known.reserve(parameters.size());
  for (const LawParameter& p : parameters) known.push_back(law_key(p));
  for (const auto& [key, value] : values) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    throw bad_input(
        where, fmt::format("unknown parameter '{}'{}", printable(key), did_you_mean(key, known)),
        fmt::format("one of {}", fmt::join(known, ", ")));
  }
}

std::vector<double> values_of(const NamedValues& values, const LawSpec& spec,
                              std::string_view where) {
  const std::vector<LawParameter> parameters = law_parameters(spec);
  require_known_keys(values, parameters, where);
  std::vector<double> result;
  result.reserve(parameters.size());
  for (const LawParameter& p : parameters) {
    const std::string key = law_key(p);
    const auto found = std::find_if(values.begin(), values.end(),
                                    [&](const auto& value) { return value.first == key; });
    if (found != values.end()) {
      result.push_back(found->second);
    } else if (p.preset) {
      result.push_back(*p.preset);
    } else {
      throw bad_input(where, fmt::format("no parameter '{}'", key), p.meaning);
    }
  }
  return result;
}

}  // namespace

ValueType<Quantity> files::quantity_among(std::initializer_list<Quantity> all) {
  std::vector<Word<Quantity>> words;
  for (const Quantity one : all) words.push_back({one, quantity_name(one)});
  return word(words);
}

std::string law_key(const LawParameter& parameter) {
  std::string unit(si_symbol(parameter.dimension));
  if (unit.empty()) return parameter.name;
  if (const auto slash = unit.find('/'); slash != std::string::npos) {
    unit.replace(slash, 1, "_per_");
  }
  return parameter.name + "_" + unit;
}

const FileKind& files::law_kind() {
  static const FileKind kind{
      "law", "A law with its parameters",
      "One member of the family of laws at given parameters. Written by fits, read by simulations "
      "and exports. Which parameters belong to a law: tpm laws NAME",
      law_block().form()};
  return kind;
}

LawFile files::law_from_json(const Json& written, const DocumentPlace& place) {
  const std::string& where = place.where;
  LawKeys keys = law_block().made(checked(written, law_kind(), place), place);
  LawFile law;
  law.spec = spec_of(keys, where);
  law.values = values_of(keys.parameters, law.spec, where);
  try {
    LawModel(law.spec).require_in_range(law.values);
  } catch (const Error& error) {
    throw error.within(where);
  }
  law.provenance = keys.provenance;
  law.note = std::move(keys.note);
  law.fitted_to = is_answered_by_stress(law.spec.drive) ? keys.fitted_to : keys.fitted_to_m;
  law.adequacy = std::move(keys.adequacy);
  if (!keys.fit.is_null()) {
    DocumentPlace fit = place;
    fit.where += ": fit";
    law.uncertainty = uncertainty_from_json(keys.fit, law.spec, law.values, fit);
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
  return law_from_json(read_json_of(path, "law"), path.string());
}

void write_law(const std::filesystem::path& path, const LawFile& law) {
  write_file(path, to_text(to_json(law)));
}

}  // namespace tpm
