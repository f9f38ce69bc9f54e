#include "tpm/files/blocks/law_export.hpp"

#include <fmt/format.h>

#include <array>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::files {
namespace {

/// Digits of the exported numbers: the curve is reproduced to 1e-6 and better.
constexpr int kDigits = 10;

struct TargetWord {
  ExportTarget meaning;
  std::string_view text;
  std::size_t most_terms;
};
// FEBio reads g1 to g6; ANSYS TB,PRONY and Abaqus take more than any law has.
constexpr auto kTargets = std::to_array<TargetWord>({{ExportTarget::abaqus, "abaqus", 50},
                                                     {ExportTarget::ansys, "ansys", 50},
                                                     {ExportTarget::febio, "febio", 6},
                                                     {ExportTarget::json, "json", 50}});

std::string digits(double value) {
  return significant(value, kDigits);
}

/// The exported law and its sentences.
struct Exported {
  std::string name;
  PronyTable table;
  std::optional<double> instant_Pa;
  double poisson_ratio;
  std::vector<Remark> remarks;
};

void require_sayable(const LawFile& law, const ExportOptions& options) {
  if (options.relaxation_only) return;
  const auto refuse = [&](std::string_view what) {
    throw bad_input(
        fmt::format("export to {}", entry_of(kTargets, options.target).text),
        fmt::format("the {} of {} has no counterpart in that format", what, law_name(law.spec)),
        "a linear or Hertz kernel without tension, or --relaxation-only");
  };
  if (law.spec.kernel == Kernel::power) refuse("power kernel");
  if (law.spec.tension != Tension::none) refuse("tension");
}

void require_terms(const PronyTable& table, ExportTarget target) {
  const TargetWord& word = entry_of(kTargets, target);
  const std::string where = fmt::format("export to {}", word.text);
  if (table.g.size() > word.most_terms) {
    throw bad_input(where, fmt::format("{} terms", table.g.size()),
                    fmt::format("at most {}", word.most_terms));
  }
  if (target == ExportTarget::febio && !(table.long_share > 0.0)) {
    throw bad_input(where, "nothing remains in the end",
                    "a solid: FEBio scales the long-term elastic material");
  }
}

/// Remarks on the parts that --relaxation-only drops and their share of the force.
void add_left_out(const LawFile& law, std::vector<Remark>& remarks) {
  const LawSpec& spec = law.spec;
  const LawModel model(spec);
  const auto value_of = [&](std::string_view name) { return law.values[model.index(name)]; };
  if (spec.kernel == Kernel::power) {
    remarks.push_back({"kernel_left_out",
                       fmt::format("left out: the power kernel (exponent {}); the stiffnesses are "
                                   "secants at the reference {}",
                                   digits(value_of("exponent")), shortest(spec.reference))});
  }
  const std::string_view unit = spec.response == Quantity::stress ? "Pa" : "N/m";
  if (spec.tension == Tension::elastic) {
    remarks.push_back({"elastic_tension_left_out",
                       fmt::format("left out: the elastic tension, {} {} at the reference {}, in "
                                   "addition to the stiffnesses "
                                   "above: the contact is stiffer by it than what is exported",
                                   digits(value_of("k_tension")), unit, shortest(spec.reference))});
  }
  if (spec.tension == Tension::relaxing) {
    remarks.push_back(
        {"relaxing_tension_left_out",
         fmt::format("left out: the shape of the tension, {} % of the stiffnesses above at the "
                     "reference {}",
                     digits(100.0 * value_of("tension_share")), shortest(spec.reference))});
  }
}

std::vector<Remark> remarks_of(const LawFile& law, const PronyTable& table,
                               const ExportOptions& options, bool has_modulus) {
  std::vector<Remark> remarks{
      {"law", fmt::format("law {}: {}; parameters {}", law_name(law.spec), law_words(law.spec),
                          provenance_name(law.provenance))}};
  const std::string_view unit = law.spec.response == Quantity::stress ? "Pa" : "N/m";
  remarks.push_back({"stiffness", fmt::format("instantaneous stiffness {} {}, in the end {} {}",
                                              digits(table.instant), unit,
                                              digits(table.instant * table.long_share), unit)});
  if (table.fitted) {
    remarks.push_back(
        {"fitted_to_fractional_law",
         fmt::format("fitted to the fractional law from {} s to {} s: largest relative "
                     "error {}; nothing is said outside",
                     shortest(table.from_s), shortest(table.to_s),
                     significant(table.worst_relative_error, 2))});
  }
  for (const Remark& warning : export_remarks(law, options)) {
    remarks.push_back({warning.code, "WARNING: " + warning.text});
  }
  const ContactGeometry& geometry = options.geometry;
  if (!has_modulus) {
    remarks.push_back(
        {"relative_moduli_only",
         "relative moduli only: a modulus in Pa needs the size of the probe, or of a bar"});
  } else if (geometry.sphere_radius_m) {
    remarks.push_back(
        {"modulus_under_sphere",
         fmt::format("modulus from the stiffness at the reference depth {} m under a sphere of {} "
                     "m (Hertz)",
                     shortest(law.spec.reference), shortest(*geometry.sphere_radius_m))});
  } else if (geometry.is_given() && !geometry.area_m2) {
    remarks.push_back(
        {"modulus_under_probe",
         fmt::format("modulus from the stiffness at the reference depth {} m under {}",
                     shortest(law.spec.reference), geometry_words(geometry))});
  } else if (geometry.area_m2) {
    remarks.push_back(
        {"modulus_of_bar", fmt::format("modulus from the stiffness of a bar of {} m^2 and {} m",
                                       shortest(*geometry.area_m2), shortest(*geometry.length_m))});
  }
  remarks.push_back(
      {"poisson_ratio_assumed",
       fmt::format("Poisson's ratio {} is assumed, and constant: bulk and shear relax "
                   "alike",
                   shortest(geometry.poisson_ratio))});
  return remarks;
}

/// A program needs a bulk modulus: 0.5 is written as a little less, with the same shear modulus,
/// which is what relaxes.
void make_compressible(Exported& e) {
  constexpr double kNearly = 0.4995;  // K = 1000 G
  const double nu = e.poisson_ratio;
  if (nu <= kNearly) return;
  if (e.instant_Pa) *e.instant_Pa *= (1.0 + kNearly) / (1.0 + nu);
  e.poisson_ratio = kNearly;
  e.remarks.push_back(
      {"poisson_ratio_written",
       fmt::format("Poisson's ratio is written as {}: the program needs a bulk modulus; the shear "
                   "modulus is that of {}",
                   shortest(kNearly), shortest(nu))});
}

/// @param before what opens a comment; no line holds "--", which XML forbids inside of one
std::string commented(const std::vector<Remark>& remarks, std::string_view before,
                      std::string_view after = {}) {
  std::string text;
  for (const Remark& remark : remarks) {
    text += fmt::format("{}{}{}\n", before, remark.text, after);
  }
  return text;
}

// Abaqus Keywords Reference: g_i and k_i are relative to the instantaneous moduli, their sum at
// most 1.
std::string abaqus_text(const Exported& e) {
  std::string text = commented(e.remarks, "** ") + "*MATERIAL, NAME=TISSUE\n";
  if (e.instant_Pa) {
    text += fmt::format("*ELASTIC, MODULI=INSTANTANEOUS\n{}, {}\n", digits(*e.instant_Pa),
                        digits(e.poisson_ratio));
  }
  if (e.table.g.empty()) return text;
  text += "*VISCOELASTIC, TIME=PRONY\n";
  for (std::size_t i = 0; i < e.table.g.size(); ++i) {
    const std::string g = digits(e.table.g[i]);
    text += fmt::format("{}, {}, {}\n", g, g, digits(e.table.tau_s[i]));
  }
  return text;
}

/// Six constants for each TBDATA line, at most.
std::string ansys_table(const PronyTable& table, std::string_view part) {
  std::string text = fmt::format("TB,PRONY,1,1,{},{}\n", table.g.size(), part);
  for (std::size_t i = 0; i < table.g.size(); ++i) {
    if (i % 3 == 0) text += fmt::format("{}TBDATA,{}", i == 0 ? "" : "\n", 2 * i + 1);
    text += fmt::format(",{},{}", digits(table.g[i]), digits(table.tau_s[i]));
  }
  return text + "\n";
}

// ANSYS Mechanical APDL: relative moduli; MP gives the instantaneous ones. No TB,SHIFT.
std::string ansys_text(const Exported& e) {
  std::string text = commented(e.remarks, "! ");
  if (e.instant_Pa) {
    text +=
        fmt::format("MP,EX,1,{}\nMP,PRXY,1,{}\n", digits(*e.instant_Pa), digits(e.poisson_ratio));
  }
  if (e.table.g.empty()) return text;
  return text + ansys_table(e.table, "SHEAR") + ansys_table(e.table, "BULK");
}

// FEBio: G(t) = 1 + sum g_i exp(-t/t_i) on the elastic material, which is the long-term one.
std::string febio_text(const Exported& e) {
  const PronyTable& t = e.table;
  std::string text = commented(e.remarks, "<!-- ", " -->");
  text += "<material id=\"1\" name=\"tissue\" type=\"viscoelastic\">\n";
  for (std::size_t i = 0; i < t.g.size(); ++i) {
    text += fmt::format("  <g{0}>{1}</g{0}>\n  <t{0}>{2}</t{0}>\n", i + 1,
                        digits(t.g[i] / t.long_share), digits(t.tau_s[i]));
  }
  if (e.instant_Pa) {
    text += fmt::format(
        "  <elastic type=\"neo-Hookean\">\n    <E>{}</E>\n    <v>{}</v>\n  </elastic>\n",
        digits(*e.instant_Pa * t.long_share), digits(e.poisson_ratio));
  } else {
    text += "  <!-- the long-term elastic material goes here -->\n";
  }
  return text + "</material>\n";
}

std::string json_text(const Exported& e, const LawFile& law) {
  const bool strip = law.spec.response == Quantity::stress;
  const PronyTable& t = e.table;
  Json json{{"law", to_json(law)},
            {strip ? "instant_Pa" : "instant_N_per_m", t.instant},
            {"long_share", t.long_share}};
  if (e.instant_Pa && !strip) json["instant_Pa"] = *e.instant_Pa;
  json["terms"] = Json::array();
  for (std::size_t i = 0; i < t.g.size(); ++i) {
    json["terms"].push_back(Json{{"g", t.g[i]}, {"tau_s", t.tau_s[i]}});
  }
  if (t.fitted) {
    json["fitted"] = Json{{"from_s", t.from_s},
                          {"to_s", t.to_s},
                          {"worst_relative_error", rounded(t.worst_relative_error, 3)}};
  }
  json["remarks"] = remarks_json(e.remarks);
  return to_text(json);
}

}  // namespace

std::vector<std::string> export_targets() {
  return mapped<std::string>(kTargets, [](const auto& word) { return word.text; });
}

ExportTarget parse_export_target(std::string_view text, std::string_view where) {
  return parse_word(kTargets, "program", text, where);
}

std::vector<Remark> export_remarks(const LawFile& law, const ExportOptions& options) {
  std::vector<Remark> remarks;
  if (law.adequacy && !law.adequacy->is_adequate()) {
    remarks.push_back({"law_in_doubt", law.adequacy->summary});
  }
  const bool drops = law.spec.kernel == Kernel::power || law.spec.tension != Tension::none;
  if (options.relaxation_only && drops) add_left_out(law, remarks);
  std::ranges::move(geometry_remarks(law.spec, options.geometry, law.fitted_to),
                    std::back_inserter(remarks));
  return remarks;
}

std::string export_law(const LawFile& law, const ExportOptions& options) {
  require_sayable(law, options);
  PronyWindow window = options.window;
  // FEBio's six terms, spread over the window, unless another number is asked for.
  if (options.target == ExportTarget::febio && window.times == 0) window.times = 6;
  Exported e{law_name(law.spec),
             prony_table(law.spec, law.values, window),
             {},
             options.geometry.poisson_ratio,
             {}};
  require_terms(e.table, options.target);
  e.instant_Pa = modulus_Pa(law.spec, e.table.instant, options.geometry);
  e.remarks = remarks_of(law, e.table, options, e.instant_Pa.has_value());
  if (options.target != ExportTarget::json) make_compressible(e);
  switch (options.target) {
    case ExportTarget::abaqus:
      return abaqus_text(e);
    case ExportTarget::ansys:
      return ansys_text(e);
    case ExportTarget::febio:
      return febio_text(e);
    case ExportTarget::json:
      break;
  }
  return json_text(e, law);
}

}  // namespace tpm::files
