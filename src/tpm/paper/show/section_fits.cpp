// Declared in tpm/paper/show/sections.hpp.
// The section on fits: estimates, intervals, minima, readings, sensitivity, held-out depths.
#include <fmt/format.h>

#include "tpm/base/printed_number.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/show/fit_cells.hpp"
#include "tpm/fit/show/fit_figures.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/paper/show/sections.hpp"

namespace tpm::paper {
namespace {

std::string interval(const ParameterResult& p) {
  if (p.verdict == Verdict::not_profiled) return "not profiled";
  const auto side = [&](const std::optional<double>& limit, bool upper) {
    return limit ? in_unit(p.parameter, *limit) : limit_text(p, upper);
  };
  return fmt::format("{} to {}", side(p.lower, false), side(p.upper, true));
}

Table estimates_table(const FitResult& fit) {
  Table table{"",
              {{"parameter"},
               {"estimate", true},
               {"standard error", true},
               {fmt::format("{:.4g} % interval", 100.0 * fit.config.level), true},
               {"verdict"}}};
  for (const ParameterResult& p : fit.parameters) {
    table.rows.push_back({{p.parameter.name},
                          {in_unit(p.parameter, p.estimate)},
                          {p.standard_error ? in_unit(p.parameter, *p.standard_error) : "-"},
                          {interval(p)},
                          {verdict_text(p), tone_of(p)}});
  }
  return table;
}

/// Findings that neither the summary nor a table states.
std::vector<Cell> findings(const FitResult& fit) {
  std::vector<Cell> items;
  if (!fit.weakest_words.empty()) items.push_back({fit.weakest_words});
  std::string chi_square = fmt::format("chi-square {} with {} degrees of freedom",
                                       significant(fit.chi_square, 4), fit.degrees_of_freedom);
  if (fit.chi_square_p) chi_square += fmt::format(", p = {}", probability(*fit.chi_square_p));
  items.push_back({std::move(chi_square)});
  for (const Remark& remark : fit.remarks) items.push_back({remark.text, Tone::fair});
  return items;
}

/// "2 mm", or "2 to 3 mm" where the starts that ended here spread.
std::string spread(const FitParameter& p, double low, double high) {
  const std::string from = in_unit(p, low);
  const std::string to = in_unit(p, high);
  return from == to ? from : fmt::format("{} to {}", from, to);
}

Table minima_table(const FitResult& fit) {
  Table table{fmt::format("Where {} starts ended ({} failed). {} end at the best minimum.",
                          fit.starts_run, fit.starts_failed, fit.starts_agreeing),
              {{"deviance", true}, {"starts", true}}};
  for (const ParameterResult& p : fit.parameters) table.columns.push_back({p.parameter.name, true});
  for (const DistinctMinimum& m : fit.minima) {
    std::vector<Cell> row{{significant(m.minimum.deviance, 6)}, {std::to_string(m.starts)}};
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
      row.push_back({spread(fit.parameters[i].parameter, m.low[i], m.high[i])});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table readings_table(const FitResult& fit) {
  Table table{"Readings and the fitted model. z is the difference in standard deviations.",
              {{"data set"},
               {"reading"},
               {"provenance"},
               {"observed", true},
               {"model", true},
               {"z", true}}};
  for (const FittedDatum& d : fit.data) {
    table.rows.push_back({{fit.config.data[d.datum.choice].dataset},
                          {d.datum.label},
                          {std::string(provenance_name(d.datum.provenance))},
                          {observed(d.datum)},
                          {predicted(d, false)},
                          {fixed(d.standardised, 2), tone_of_residual(d.standardised)}});
  }
  return table;
}

/// "13.46 (11.82 to 14.85)" in the unit of the column; an open side is named.
std::string estimate_and_interval(const ParameterResult& p) {
  const double unit = p.parameter.unit.to_si;
  const auto limit = [&](const std::optional<double>& value) {
    return value ? significant(*value / unit, 4) : std::string("open");
  };
  return fmt::format("{} ({} to {})", significant(p.estimate / unit, 4), limit(p.lower),
                     limit(p.upper));
}

std::vector<Cell> assumptions_of(const FitVariant& v) {
  return {{fmt::format("{:.4g} mm/s", v.rate_m_per_s * 1e3)}, {noise_words(v.noise)}};
}

Table sensitivity_table(const FitStudy& study) {
  Table table{"Estimates and intervals of the same fit under other assumptions.",
              {{"ramp rate", true}, {"noise"}}};
  for (const ParameterResult& p : study.reference.parameters) {
    table.columns.push_back(
        {fmt::format("{} [{}]", p.parameter.name, p.parameter.unit.symbol), true});
  }
  table.columns.push_back({"chi-square", true});
  for (const FitVariant& v : study.variants) {
    std::vector<Cell> row = assumptions_of(v);
    for (const ParameterResult& p : v.result.parameters) {
      row.push_back({estimate_and_interval(p), tone_of(p)});
    }
    row.push_back({significant(v.result.chi_square, 4)});
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table claims_table(const FitStudy& study) {
  Table table{"Whether the data exclude a claim, and its p, under the same assumptions.",
              {{"ramp rate", true}, {"noise"}}};
  for (const Hypothesis& h : study.reference.config.hypotheses) table.columns.push_back({h.name});
  for (const FitVariant& v : study.variants) {
    std::vector<Cell> row = assumptions_of(v);
    for (const HypothesisResult& h : v.result.hypotheses) {
      row.push_back({fmt::format("{}, p = {}", h.excluded ? "excluded" : "not excluded",
                                 probability(h.p_value)),
                     h.excluded ? Tone::bad : Tone::plain});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table held_out_table(const FitStudy& study) {
  Table table{
      "Each depth in turn left out of the fit and predicted by the rest. ± is the standard "
      "error from the parameters alone.",
      {{"depth", true},
       {"reading"},
       {"observed", true},
       {"predicted", true},
       {"difference", true},
       {"z", true}}};
  for (const HeldOutFit& h : study.held_out) {
    for (const FittedDatum& d : h.result.data) {
      if (!d.datum.held_out || !d.datum.value) continue;
      const double percent = 100.0 * (d.predicted - *d.datum.value) / *d.datum.value;
      table.rows.push_back({{fmt::format("{:.4g} mm", h.depth_m * 1e3)},
                            {d.datum.label},
                            {observed(d.datum)},
                            {predicted(d, true)},
                            {percent_text(percent, 1)},
                            {fixed(d.standardised, 2), tone_of_residual(d.standardised)}});
    }
  }
  return table;
}

}  // namespace

void add_fits(Document& document, const PaperReport& report) {
  const FitStudy& study = report.fits;
  const FitResult& fit = study.reference;
  document.heading(2, "Fits");
  document.paragraph(
      fmt::format("{}. {} values, {} bands. The eight numbers that are fitted validate nothing by "
                  "themselves; the held-out depths below do.",
                  fit.config.title, fit.value_count, fit.band_count));
  document.table(estimates_table(fit));
  document.bullets(findings(fit));
  document.picture(caption_of(report, "fit_profiles"));
  document.heading(3, "Starts and minima");
  document.table(minima_table(fit));
  document.heading(3, "Readings");
  document.table(readings_table(fit));
  document.heading(3, "What the answer depends on");
  document.table(sensitivity_table(study));
  document.table(claims_table(study));
  document.picture(caption_of(report, "fit_sensitivity_eta1"));
  document.heading(3, "Held-out depths");
  document.table(held_out_table(study));
}

}  // namespace tpm::paper
