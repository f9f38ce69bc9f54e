#include "tpm/paper/show/organ_study_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/show/fit_cells.hpp"
#include "tpm/law/element/validity_limits.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::paper {
namespace {

using Kind = ProtocolChoice::Kind;

std::string millimetres(double metres) {
  return fmt::format("{} mm", significant(1e3 * metres, 4));
}

std::string element_words(const TpmVector& p) {
  return fmt::format("E1 = {0} kPa, E2 = {1} kPa, E' = {2} kPa, eta1 = {3} kPa s, x = {4} mm",
                     significant(1e-3 * p[kE1], 4), significant(1e-3 * p[kE2], 4),
                     significant(1e-3 * p[kEprime], 4), significant(1e-3 * p[kEta1], 4),
                     significant(1e3 * p[kSpacing], 4));
}

std::string percent_number(double share) {
  return fmt::format("{}{}", share < 0.0 ? "" : "+", significant(100.0 * share, 3));
}

std::string percent(double share) {
  return percent_number(share) + " %";
}

/// The imposed condition: "4 mm at 2 mm/s", "0.98 N", "static".
std::string condition_words(const StudyCondition& c) {
  switch (c.kind) {
    case Kind::ramp_hold:
      return fmt::format("{} at {} mm/s", millimetres(c.depth_m),
                         significant(1e3 * c.rate_m_per_s, 4));
    case Kind::creep:
      return fmt::format("{} N", significant(c.load_N, 4));
    default:
      return "static";
  }
}

/// Without its unit, which the caption of the table names: mm of creep, else N.
std::string response_number(Kind kind, double response) {
  return significant(kind == Kind::creep ? 1e3 * response : response, 4);
}

/// Least and most of what a tissue's readings of one kind differ from the first tissue's.
struct CostRange {
  double least = 0.0, most = 0.0;
  bool any = false;

  void add(double share) {
    least = any ? std::min(least, share) : share;
    most = any ? std::max(most, share) : share;
    any = true;
  }
  [[nodiscard]] std::string words() const {
    const bool rising = std::abs(most) > std::abs(least);
    return fmt::format("{} to {}", percent(rising ? least : most), percent(rising ? most : least));
  }
};

CostRange cost_range(const OrganStudy& study, const StudyCurves& set, std::size_t tissue,
                     Kind kind) {
  CostRange range;
  for (const StudyCurve& curve : set.curves) {
    if (curve.tissue != tissue || study.config.conditions[curve.condition].kind != kind) continue;
    for (const StudyReading& r : curve.readings) {
      if (r.against_first) range.add(*r.against_first);
    }
  }
  return range;
}

std::string cost_sentence(const OrganStudy& study, const StudyCurves& set, std::size_t tissue) {
  std::vector<std::string> parts;
  for (const auto& [kind, what] : {std::pair{Kind::static_, "static force"},
                                   std::pair{Kind::ramp_hold, "force of ramp and hold"},
                                   std::pair{Kind::creep, "depth of creep"}}) {
    const CostRange range = cost_range(study, set, tissue, kind);
    if (range.any) parts.push_back(fmt::format("{} {}", what, range.words()));
  }
  return fmt::format("At one material ({}; {}) '{}' differs from '{}' by: {}.", set.material,
                     element_words(set.parameters.value()), study.config.tissues[tissue].name,
                     study.config.tissues.front().name, fmt::join(parts, ", "));
}

/// A row per condition and reading, the tissues side by side.
Table readings_table(const OrganStudy& study, const StudyCurves& set, Kind kind,
                     std::string caption) {
  Table table{std::move(caption), {{"imposed"}, {"reading"}}};
  const bool compared = set.parameters.has_value();
  for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
    table.columns.push_back({study.config.tissues[t].name, true});
    if (compared && t > 0) table.columns.push_back({"difference, %", true});
  }
  for (std::size_t c = 0; c < study.config.conditions.size(); ++c) {
    if (study.config.conditions[c].kind != kind) continue;
    std::vector<StudyReading> labels;
    for (std::size_t t = 0; t < study.config.tissues.size() && labels.empty(); ++t) {
      labels = set.at(c, t).readings;
    }
    for (std::size_t i = 0; i < labels.size(); ++i) {
      std::vector<Cell> row{{condition_words(study.config.conditions[c])}, {labels[i].label}};
      for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
        const StudyCurve& curve = set.at(c, t);
        const bool failed = curve.readings.empty();
        row.push_back({failed ? "none" : response_number(kind, curve.readings[i].response),
                       failed ? Tone::bad : Tone::plain});
        if (!compared || t == 0) continue;
        const bool known = !failed && curve.readings[i].against_first;
        row.push_back({known ? percent_number(*curve.readings[i].against_first) : "-"});
      }
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

/// The largest depth that any tissue creeps to, m.
double deepest_m(const OrganStudy& study) {
  double deepest = 0.0;
  for (const StudyCurves& set : study.curves) {
    for (const StudyCurve& curve : set.curves) {
      if (study.config.conditions[curve.condition].kind != Kind::creep) continue;
      for (const StudyReading& r : curve.readings) deepest = std::max(deepest, r.response);
    }
  }
  return deepest;
}

void add_readings(Document& document, const OrganStudy& study, const StudyCurves& set) {
  for (const auto& [kind, caption] :
       {std::pair{Kind::static_, "Static force, at equilibrium, N."},
        std::pair{Kind::ramp_hold, "Force at the end of the ramp (peak) and of the hold (end), N."},
        std::pair{Kind::creep, "Depth of creep, mm."}}) {
    Table table = readings_table(study, set, kind, caption);
    if (!table.rows.empty()) document.table(std::move(table));
  }
  std::vector<Cell> remarks;
  for (const StudyCurve& curve : set.curves) {
    if (curve.failure.empty()) continue;
    remarks.push_back(
        {fmt::format("'{}', {}: {}", study.config.tissues[curve.tissue].name,
                     condition_words(study.config.conditions[curve.condition]), curve.failure),
         Tone::bad});
  }
  if (!remarks.empty()) document.bullets(std::move(remarks));
}

/// "13.2 kPa (11.6 to 14.6)", "above 21.1 mm (best 1000)", "undetermined".
Cell estimate_cell(const FitResult& fit, const ParameterResult& p) {
  const double unit = p.parameter.unit.to_si;
  const auto text = [&](double value) { return significant(value / unit, 4); };
  // Where all bands are met the estimate is any point of a region.
  const std::string best = fit.value_count == 0 && fit.best.deviance == 0.0
                               ? std::string()
                               : fmt::format(" (best {})", text(p.estimate));
  const std::string& symbol = p.parameter.unit.symbol;
  const Tone tone = tone_of(p);
  switch (p.verdict) {
    case Verdict::identified:
      return {best.empty() ? fmt::format("{} to {} {}", text(*p.lower), text(*p.upper), symbol)
                           : fmt::format("{} {} ({} to {})", text(p.estimate), symbol,
                                         text(*p.lower), text(*p.upper)),
              tone};
    case Verdict::lower_only:
      return {fmt::format("above {} {}{}", text(*p.lower), symbol, best), tone};
    case Verdict::upper_only:
      return {fmt::format("below {} {}{}", text(*p.upper), symbol, best), tone};
    case Verdict::flat:
      return {"undetermined" + best, tone};
    case Verdict::failed:
      return {"profile failed" + best, tone};
    case Verdict::not_profiled:
      break;
  }
  return {fmt::format("{} {}, no interval", text(p.estimate), symbol), tone};
}

Cell hypothesis_cell(const HypothesisResult& h) {
  return {
      fmt::format("{}, p = {}", h.excluded ? "excluded" : "not excluded", probability(h.p_value)),
      h.excluded ? Tone::bad : Tone::plain};
}

Table fits_table(const OrganStudy& study) {
  Table table{"Estimates with profile-likelihood intervals.", {{"data"}, {"tissue"}}};
  const FitConfig& any = study.config.fits.front().configs.front();
  for (const EstimatedParameter& p : any.parameters) table.columns.push_back({p.fit.name, true});
  table.columns.push_back({"chi-square", true});
  table.columns.push_back({"values + bands", true});
  for (const Hypothesis& h : any.hypotheses) table.columns.push_back({h.name});
  for (const TissueFit& made : study.fits) {
    std::vector<Cell> row{{study.config.fits[made.fit].name},
                          {study.config.tissues[made.tissue].name}};
    if (!made.result) {
      row.push_back({made.failure, Tone::bad});
      row.resize(table.columns.size());
      table.rows.push_back(std::move(row));
      continue;
    }
    const FitResult& fit = *made.result;
    for (const ParameterResult& p : fit.parameters) row.push_back(estimate_cell(fit, p));
    row.push_back({significant(fit.chi_square, 4)});
    row.push_back({fmt::format("{} + {}", fit.value_count, fit.band_count)});
    // Those of the materials come behind what every fit tests.
    for (std::size_t i = 0; i < any.hypotheses.size(); ++i) {
      row.push_back(hypothesis_cell(fit.hypotheses[i]));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Every reading of a fit and what each tissue makes of it.
Table answers_table(const OrganStudy& study, std::size_t fit) {
  Table table{fmt::format("Fit '{}'.", study.config.fits[fit].name),
              {{"data set"}, {"reading"}, {"provenance"}, {"observed", true}}};
  const FitResult* first = nullptr;
  for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
    table.columns.push_back({study.config.tissues[t].name, true});
    table.columns.push_back({"z", true});
    const auto& result = study.fit(fit, t).result;
    if (first == nullptr && result) first = &*result;
  }
  if (first == nullptr) return table;
  for (std::size_t i = 0; i < first->data.size(); ++i) {
    const FitDatum& datum = first->data[i].datum;
    std::vector<Cell> row{{first->config.data[datum.choice].dataset},
                          {datum.label},
                          {std::string(provenance_name(datum.provenance))},
                          {observed(datum)}};
    for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
      const auto& result = study.fit(fit, t).result;
      row.push_back({result ? predicted(result->data[i], false) : "none"});
      row.push_back({result ? fixed(result->data[i].standardised, 2) : "-",
                     result ? tone_of_residual(result->data[i].standardised) : Tone::bad});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Remarks on the fits: each once, with the fits that carry it.
Table remarks_table(const OrganStudy& study) {
  Table table{"Remarks of the fits.", {{"remark"}, {"fits"}}};
  for (const TissueFit& made : study.fits) {
    if (!made.result) continue;
    const std::string name = fmt::format("{} on {}", study.config.fits[made.fit].name,
                                         study.config.tissues[made.tissue].name);
    for (const Remark& remark : made.result->remarks) {
      const auto known = std::ranges::find_if(
          table.rows, [&](const std::vector<Cell>& row) { return row[0].text == remark.text; });
      if (known == table.rows.end()) {
        table.rows.push_back({{remark.text}, {name}});
      } else {
        (*known)[1].text += "; " + name;
      }
    }
  }
  return table;
}

/// "Searched: E 2 to 100 kPa; ..."
std::string searched_words(const OrganStudy& study) {
  const auto range = [](const EstimatedParameter& p) {
    const double unit = p.fit.unit.to_si;
    return fmt::format("{} {} to {} {}", p.fit.name, significant(p.fit.lower / unit, 4),
                       significant(p.fit.upper / unit, 4), p.fit.unit.symbol);
  };
  return fmt::format(
      "Searched: {}. 'undetermined': every value searched fits. 'best' is left out where all bands "
      "are met.",
      listed(study.config.fits.front().configs.front().parameters, range, "; "));
}

/// Difference of each tissue from the first at one material.
Table costs_table(const OrganStudy& study) {
  Table table{fmt::format("Least and largest difference from '{}' at one material.",
                          study.config.tissues.front().name),
              {{"material"},
               {"tissue"},
               {"static force", true},
               {"force of ramp and hold", true},
               {"depth of creep", true}}};
  for (const StudyCurves& set : study.curves) {
    if (!set.parameters) continue;
    for (std::size_t t = 1; t < study.config.tissues.size(); ++t) {
      std::vector<Cell> row{{set.material}, {study.config.tissues[t].name}};
      for (const Kind kind : {Kind::static_, Kind::ramp_hold, Kind::creep}) {
        const CostRange range = cost_range(study, set, t, kind);
        row.push_back({range.any ? range.words() : "-"});
      }
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

/// Chi-square of each fit on each tissue.
Table chi_squares_table(const OrganStudy& study) {
  Table table{"Chi-square.", {{"fit"}, {"parameters", true}}};
  for (const auto& tissue : study.config.tissues) table.columns.push_back({tissue.name, true});
  for (std::size_t f = 0; f < study.config.fits.size(); ++f) {
    const FitConfig& config = study.config.fits[f].configs.front();
    std::vector<Cell> row{{study.config.fits[f].name}, {std::to_string(config.parameters.size())}};
    for (std::size_t t = 0; t < study.config.tissues.size(); ++t) {
      const auto& result = study.fit(f, t).result;
      row.push_back(result ? Cell{significant(result->chi_square, 4)} : Cell{"failed", Tone::bad});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

void add_summary(Document& document, const OrganStudy& study) {
  document.heading(2, "Summary");
  document.table(costs_table(study));
  document.table(chi_squares_table(study));
  if (const double deepest = deepest_m(study); deepest > kValidIndentation_m) {
    document.bullets({{fmt::format("Creep goes as deep as {}: over {} is outside the paper's "
                                   "validity, and liver is damaged over {}.",
                                   millimetres(deepest), millimetres(kValidIndentation_m),
                                   millimetres(kDamageIndentation_m)),
                       Tone::fair}});
  }
}

void add_costs(Document& document, const OrganStudy& study) {
  document.heading(2, "What \"we ignore the displacement of the spheres A and C\" costs");
  document.paragraph(fmt::format(
      "All tissues at one material. The difference is that from '{}', whose neighbours A and C and "
      "partner D are fixed.",
      study.config.tissues.front().name));
  for (std::size_t m = 0; m < study.config.materials.size(); ++m) {
    const StudyMaterial& material = study.config.materials[m];
    const StudyCurves& set = study.curves[m];
    document.heading(3, fmt::format("Material '{}'", material.name));
    std::string words =
        fmt::format("{}: the fit '{}' of '{}'", element_words(set.parameters.value()),
                    study.config.fits[material.fit].name, study.config.tissues.front().name);
    for (const auto& [name, value] : material.fixed.values)
      words += fmt::format(", {} fixed", name);
    for (const HypothesisResult& h : study.fit(material.fit, 0).result->hypotheses) {
      if (material.fixed.values.empty() || h.hypothesis.name != material.fixed.name) continue;
      words += fmt::format(" (the deviance rises by {}, p = {})", significant(h.rise, 4),
                           probability(h.p_value));
    }
    document.paragraph(words + ".");
    add_readings(document, study, set);
  }
}

/// @param figures of organ_study_figures
Document organ_study_document(const OrganStudy& study, const std::vector<Figure>& figures) {
  Document document;
  document.title = study.config.title;
  document.subtitle = study.config.description;
  add_summary(document, study);
  add_costs(document, study);
  document.heading(2, "Fits");
  document.table(fits_table(study));
  document.paragraph(searched_words(study));
  document.paragraph(
      "The readings of each fit, and the answers of the fitted tissues. z is the difference in "
      "standard deviations; 0 within a band.");
  for (std::size_t f = 0; f < study.config.fits.size(); ++f) {
    document.table(answers_table(study, f));
  }
  if (Table remarks = remarks_table(study); !remarks.rows.empty()) {
    document.table(std::move(remarks));
  }
  document.heading(2, "The experiments, each tissue at its own fit");
  add_readings(document, study, study.curves.back());
  document.heading(2, "Figures");
  document.paragraph(
      "Lines are computed; filled marks and bars are printed or measured; open, hatched and dashed "
      "ones carry an assumption, which the legend names.");
  for (const Figure& figure : figures) {
    document.picture({figure.id, figure.title, figure.caption});
  }
  typeset(document);
  return document;
}

}  // namespace

std::vector<std::string> cost_sentences(const OrganStudy& study) {
  std::vector<std::string> sentences;
  for (const StudyCurves& set : study.curves) {
    if (!set.parameters) continue;
    for (std::size_t t = 1; t < study.config.tissues.size(); ++t) {
      sentences.push_back(cost_sentence(study, set, t));
    }
  }
  return sentences;
}

void write_organ_study(const OrganStudy& study, const std::filesystem::path& folder,
                       const std::string& python, double seconds) {
  const std::vector<Figure> figures = organ_study_figures(study);
  write_report(folder, organ_study_document(study, figures), figures, python,
               {{"fits and curves", seconds}});
  write_file(folder / "experiments.json", to_text(to_json(study)));
  write_file(folder / "readings.csv", readings_csv(study));
  write_file(folder / "fits.csv", fits_csv(study));
  write_file(folder / "curves.csv", curves_csv(study));
}

}  // namespace tpm::paper
