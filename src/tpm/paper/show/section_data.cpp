// Declared in tpm/paper/show/sections.hpp.
// The sections on data, on validity and on what is assumed.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/text.hpp"
#include "tpm/fit/show/fit_figures.hpp"
#include "tpm/paper/show/sections.hpp"
#include "tpmkit/model.hpp"

namespace tpm::paper {
namespace {

std::vector<const PointSet*> data_sets(const PaperReport& report) {
  const PaperFigureData& d = report.figure_data;
  return {&d.relaxation, &d.static_bands, &d.creep};
}

std::string imposed(const Datum& d) {
  std::string text;
  if (d.depth_m) text = fmt::format("{:.4g} mm", *d.depth_m * 1e3);
  if (d.load_N) text = fmt::format("{:.4g} N", *d.load_N);
  if (!d.label.empty()) text += ", " + d.label;
  if (d.time_s) text += fmt::format(", {:.4g} s", *d.time_s);
  return text;
}

std::string reading(const Datum& d, Observable observable) {
  const bool force = observable == Observable::contact_force;
  const double unit = force ? 1.0 : 1e-3;
  const std::string_view symbol = force ? "N" : "mm";
  if (d.value) return fmt::format("{} {}", significant(*d.value / unit, 4), symbol);
  return fmt::format("{} to {} {}", significant(*d.lower / unit, 4),
                     significant(*d.upper / unit, 4), symbol);
}

Table readings(const PointSet& set) {
  Table table{"", {{"imposed"}, {"reading", true}, {"provenance"}, {"printed in"}}};
  const bool time_assumed = set.time_provenance == Provenance::assumed;
  for (const Datum& d : set.data) {
    const std::string note = time_assumed && d.time_s ? "; time assumed" : "";
    table.rows.push_back({{imposed(d)},
                          {reading(d, set.observable)},
                          {std::string(provenance_name(d.provenance)) + note,
                           note.empty() ? Tone::plain : Tone::fair},
                          {d.where}});
  }
  return table;
}

struct ValidityCase {
  std::string name;
  double spacing_m, depth_m;
};

/// Depths that the report's own computations reach.
std::vector<ValidityCase> reached_depths(const PaperReport& report) {
  const BondElement paper = report.figure_data.paper;
  double deepest = 0.0;
  for (const Datum& d : report.figure_data.relaxation.data) {
    deepest = std::max(deepest, d.depth_m.value_or(0.0));
  }
  std::vector<ValidityCase> cases{
      {"relaxation, deepest, stated parameters", paper.spacing_m, deepest},
      {"relaxation, deepest, fitted parameters", report.figure_data.fitted.spacing_m, deepest}};
  for (const PrintedCreep& creep : report.figure_data.printed_creep) {
    cases.push_back({fmt::format("creep at {:.4g} N, λ₁(ε)", creep.load_N), paper.spacing_m,
                     equilibrium_depth_m(paper, paper.equilibrium_Pa, creep.load_N)});
    cases.push_back({fmt::format("creep at {:.4g} N, Eq. 18 as printed", creep.load_N),
                     paper.spacing_m, creep.end_depth_m});
  }
  return cases;
}

}  // namespace

void add_data(Document& document, const PaperReport& report) {
  document.heading(2, "Data");
  document.paragraph(
      "Every number below was read in print; none was read off a figure. A range is a range: no "
      "mean and no curve is made from it.");
  for (const PointSet* set : data_sets(report)) {
    document.heading(3, set->header.title);
    document.paragraph(fmt::format("{}. doi {}. Specimen: {}. Data set `{}`, SHA-256 {}.",
                                   set->header.citation, set->header.doi, set->header.specimen,
                                   set->header.id, set->header.sha256.substr(0, 16)));
    if (!set->header.note.empty()) document.paragraph(set->header.note);
    document.table(readings(*set));
  }
}

void add_validity(Document& document, const PaperReport& report) {
  document.heading(2, "Validity");
  document.paragraph(
      "The paper limits its model to 10 mm of indentation, reports damage from 12 mm on, and lets "
      "its bonds turn by less than 30 degrees.");
  Table table{"", {{"case"}, {"depth", true}, {"limits passed"}}};
  for (const ValidityCase& c : reached_depths(report)) {
    const auto passed = remark_texts(validity_remarks(c.spacing_m, c.depth_m));
    table.rows.push_back({{c.name},
                          {fmt::format("{:.2f} mm", c.depth_m * 1e3)},
                          {passed.empty() ? "none" : fmt::format("{}", fmt::join(passed, "; ")),
                           passed.empty() ? Tone::good : Tone::bad}});
  }
  document.table(std::move(table));
}

void add_assumptions(Document& document, const PaperReport& report) {
  document.heading(2, "What is assumed");
  const BondElement p = report.figure_data.paper;
  std::vector<Cell> items{
      {fmt::format("The paper uses the displacement in mm as a strain and a force per area: the "
                   "reference length l0 = {:.4g} mm is implied, not stated, and A0 = {:.4g} mm² is "
                   "derived from the printed 0.613 N.",
                   p.l0_m * 1e3, p.A0_m2 * 1e6)}};
  for (const DataChoice& d : report.fits.reference.config.data) {
    items.push_back(
        {fmt::format("`{}`: ramp rate of {:.4g} mm/s and noise {} ({:.3g} %); "
                     "neither is stated.",
                     d.dataset, d.protocol.rate_m_per_s * 1e3, noise_words(d.noise.kind),
                     100.0 * d.noise.relative)});
  }
  for (const PointSet* set : data_sets(report)) {
    if (set->time_provenance != Provenance::assumed) continue;
    const bool ramp = set->time_origin == TimeOrigin::end_of_ramp;
    items.push_back({fmt::format("`{}`: {}", set->header.id,
                                 ramp ? "its times are taken to count from the end of the ramp."
                                      : "its ranges are taken to be those at the end of the creep, "
                                        "not those of the whole curve.")});
  }
  items.push_back({"The range of static forces is compared with the equilibrium force, t → ∞."});
  items.push_back(
      {"The creep data were taken with a 6 mm punch (derived from the loads and stresses of the "
       "original abstract); the model has the area of a 4 mm sphere's circle."});
  document.bullets(std::move(items));
}

}  // namespace tpm::paper
