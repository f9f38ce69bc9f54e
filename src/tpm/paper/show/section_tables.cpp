// Declared in tpm/paper/show/sections.hpp.
// The section on Tables 1-5: every printed cell with its recomputation and verdict.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "tpm/base/printed_number.hpp"
#include "tpm/base/text.hpp"
#include "tpm/paper/show/sections.hpp"

namespace tpm::paper {
namespace {

Tone tone_of_digits(DigitVerdict verdict) {
  switch (verdict) {
    case DigitVerdict::by_rounding:
    case DigitVerdict::by_truncation:
      return Tone::good;
    case DigitVerdict::last_digit_off:
      return Tone::fair;
    case DigitVerdict::differs:
      break;
  }
  return Tone::bad;
}

/// "0.304 · 0.30436", and the verdict if it is not exact by rounding; forces from the printed
/// lambda1, as the paper did.
Cell printed_cell(const TableCell& cell, double unit) {
  if (!cell.printed) return {significant(cell.value / unit, 5)};
  const PrintedCell& printed = *cell.printed;
  const DigitCheck& check = printed.from_printed_lambda1.value_or(printed.from_computed_lambda1);
  std::string words = fmt::format("{} · {}", check.printed.text, significant(check.computed, 5));
  if (check.verdict == DigitVerdict::by_truncation) words += " · cut";
  if (!check.explained()) words += " · " + check.words();
  return {std::move(words), tone_of_digits(check.verdict)};
}

Cell measured_cell(const TableCell& cell) {
  if (!cell.measured) return {"-"};
  return {
      fmt::format("{} ({})", cell.measured->text, percent_text(cell.measured->misfit_percent, 1))};
}

Table relaxation_table(const TablesResult& tables, double depth_m) {
  std::string where;
  Table table{"",
              {{"x [mm]", true},
               {"λ₁ [kPa]"},
               {"instantaneous force [N]"},
               {"equilibrium force [N]"},
               {"liver, peak [N]", true},
               {"liver, 30 s [N]", true}}};
  for (const TableRow& row : tables.rows) {
    if (row.depth_m != depth_m) continue;
    where = row.printed_where;
    table.rows.push_back({{fmt::format("{:.4g}", row.spacing_m * 1e3)},
                          printed_cell(row.lambda1, 1e3),
                          printed_cell(row.peak_force, 1.0),
                          printed_cell(row.end_force, 1.0),
                          measured_cell(row.peak_force),
                          measured_cell(row.end_force)});
  }
  table.caption = fmt::format("{}: depth {:.4g} mm", where, depth_m * 1e3);
  return table;
}

Table band_table(const TablesResult& tables) {
  Table table{"Table 5: equilibrium force against the range over three pigs",
              {{"depth [mm]", true}, {"force [N]"}, {"range [N]", true}, {"inside"}}};
  for (const BandRow& row : tables.bands) {
    table.rows.push_back({{fmt::format("{:.4g}", row.depth_m * 1e3)},
                          printed_cell(row.force, 1.0),
                          {fmt::format("{} to {}", row.band_low, row.band_high)},
                          {row.inside ? "yes" : "no", row.inside ? Tone::good : Tone::bad}});
  }
  return table;
}

/// The spacing that the paper chose in the end.
constexpr double kChosenSpacing_m = 0.030;

Table consistent_table(const TablesResult& consistent) {
  Table table{"x = 30 mm, with the ramp and the stated dashpot in the computation",
              {{"depth [mm]", true},
               {"end of ramp [N]", true},
               {"30 s later [N]", true},
               {"liver, peak (misfit)", true},
               {"liver, 30 s (misfit)", true}}};
  for (const TableRow& row : consistent.rows) {
    if (std::abs(row.spacing_m - kChosenSpacing_m) > 1e-9) continue;
    table.rows.push_back({{fmt::format("{:.4g}", row.depth_m * 1e3)},
                          {fixed(row.peak_force.value, 3)},
                          {fixed(row.end_force.value, 3)},
                          measured_cell(row.peak_force),
                          measured_cell(row.end_force)});
  }
  return table;
}

}  // namespace

void add_tables(Document& document, const PaperReport& report) {
  document.heading(2, "Tables 1 to 5");
  document.paragraph(
      "In each cell: printed · recomputed, and the verdict unless rounding explains the printed "
      "digits; 'cut': cutting digits off does. Forces are recomputed from the printed λ₁, "
      "as the paper did; a number printed with few digits is explained by a wide range of values, "
      "so `tables.json` holds the width of that range too. Behind the liver's values stands the "
      "model's misfit.");
  std::set<double> depths;
  for (const TableRow& row : report.tables.rows) depths.insert(row.depth_m);
  for (const double depth : depths) document.table(relaxation_table(report.tables, depth));
  document.table(band_table(report.tables));
  document.heading(3, "The same with the stated dashpot and a ramp");
  document.paragraph(fmt::format(
      "The tables take a step of displacement. With the stated dashpot the relaxation time is "
      "{:.3g} ms, and after a ramp of {:.4g} mm/s nothing is left to relax.",
      report.figure_data.paper.relaxation_time_s() * 1e3,
      report.consistent.request.rate_m_per_s * 1e3));
  document.table(consistent_table(report.consistent));
}

}  // namespace tpm::paper
