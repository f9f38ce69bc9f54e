// Declared in tpm/paper/claims/audit_kinds.hpp.
// The kinds of claims that speak of many numbers at once: bands, tables and misfits.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/distributions.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/paper/claims/audit_kinds.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

/// One row of a table that a claim speaks of, with a name for it.
struct ClaimRow {
  const PrintedTable* table;
  std::size_t row;
  std::string words;
};

std::string row_words(const PrintedTable& table, std::size_t row) {
  std::string words = table.where;
  for (const auto& [name, value] : table.constants) words += fmt::format(", {} {}", name, value);
  return words + fmt::format(", {} {}", table.columns.front().name,
                             with_unit(table.rows[row].front(), table.columns.front().unit));
}

/// True if the row has the printed values that the claim asks for.
bool selected(const ClaimReader& claim, const PrintedTable& table, std::size_t row) {
  return !claim->rows || std::ranges::all_of(*claim->rows, [&](const auto& asked) {
    return table.rows[row][table.column(asked.first, claim.at())] == asked.second;
  });
}

std::vector<ClaimRow> claim_rows(const ClaimReader& claim) {
  std::vector<ClaimRow> rows;
  for (const std::string& id : claim.needed(&Claim::tables)) {
    const PrintedTable& table = claim.set().table(id, claim.at());
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      if (selected(claim, table, r)) rows.push_back({&table, r, row_words(table, r)});
    }
  }
  if (rows.empty()) throw bad_input(claim.at(), "no row of its tables is chosen", "at least one");
  return rows;
}

std::string expressions(const std::vector<ClaimSeries>& all) {
  const auto words = [](const ClaimSeries& s) {
    return fmt::format("{} = {}", s.column, s.expression);
  };
  return listed(all, words, "; ");
}

void check_single_band(const ClaimReader& claim, Finding& finding) {
  const ClaimValue value(claim);
  const Scope scope = claim.scope();
  const Unit unit = claim.unit();
  const auto [low, high] = claim.printed_pair();
  const double computed = value.total(scope) / unit.to_si;
  finding.printed = fmt::format("{} - {}", low.text, with_unit(high.text, unit));
  finding.recomputed = {computed, unit};
  finding.expression = value.expression();
  finding.inputs = value.inputs(scope);
  const bool inside = low.value <= computed && computed <= high.value;
  finding.verdict = inside ? AuditVerdict::holds : AuditVerdict::contradicted;
  const double nearest = computed < low.value ? low.value : high.value;
  if (!inside && nearest != 0.0) {
    finding.difference_percent = 100.0 * (computed - nearest) / std::abs(nearest);
  }
}

void check_band_rows(const ClaimReader& claim, Finding& finding) {
  const std::string& expression = claim.needed(&Claim::expression);
  const Claim::Texts& band = claim.needed(&Claim::band);
  finding.expression = expression;
  finding.verdict = AuditVerdict::holds;
  AuditCells cells;
  for (const ClaimRow& row : claim_rows(claim)) {
    const std::size_t low = row.table->column(band.at(0), claim.at());
    const std::size_t high = row.table->column(band.at(1), claim.at());
    const Unit& unit = row.table->columns[low].unit;
    const double computed = claim.evaluate(expression, claim.row_scope(*row.table, row.row));
    const bool inside = row.table->si(row.row, low, claim.at()) <= computed &&
                        computed <= row.table->si(row.row, high, claim.at());
    ++cells.cells;
    cells.by_rounding += inside ? 1 : 0;
    if (!inside) finding.verdict = AuditVerdict::contradicted;
    finding.details.push_back({row.words,
                               fmt::format("{} - {}", row.table->rows[row.row][low],
                                           with_unit(row.table->rows[row.row][high], unit)),
                               {computed / unit.to_si, unit},
                               inside ? "inside" : "outside",
                               std::nullopt});
  }
  finding.cells = cells;
  finding.printed = fmt::format("{} bands", cells.cells);
}

}  // namespace

void check_band(const ClaimReader& claim, Finding& finding) {
  if (claim->tables) {
    check_band_rows(claim, finding);
  } else {
    check_single_band(claim, finding);
  }
}

void check_table(const ClaimReader& claim, Finding& finding) {
  const std::vector<ClaimSeries>& series = claim.needed(&Claim::series);
  AuditCells cells;
  double worst = 0.0;
  finding.verdict = AuditVerdict::holds;
  for (const ClaimRow& row : claim_rows(claim)) {
    const Scope scope = claim.row_scope(*row.table, row.row);
    for (const ClaimSeries& s : series) {
      const std::size_t column = row.table->column(s.column, claim.at());
      const Unit& unit = row.table->columns[column].unit;
      const DigitCheck check =
          compare_digits(parse_printed(row.table->rows[row.row][column], claim.at()),
                         claim.evaluate(s.expression, scope) / unit.to_si);
      ++cells.cells;
      cells.by_rounding += check.verdict == DigitVerdict::by_rounding ? 1 : 0;
      cells.by_truncation += check.verdict == DigitVerdict::by_truncation ? 1 : 0;
      const double difference = check.difference_percent.value_or(0.0);
      if (!check.explained() && std::abs(difference) > std::abs(worst)) worst = difference;
      add_check(finding, fmt::format("{}, {}", row.words, s.column), check, unit);
    }
  }
  finding.cells = cells;
  finding.difference_percent = worst;
  finding.expression = expressions(series);
  finding.printed = fmt::format("{} cells", cells.cells);
}

void check_misfit(const ClaimReader& claim, Finding& finding) {
  const std::vector<ClaimSeries>& series = claim.needed(&Claim::series);
  const Unit plain{"", Dimension::dimensionless, 1.0};
  const Unit percent = parse_unit("%", claim.at());
  double squared = 0.0;
  double worst = 0.0;
  int data = 0;
  for (const ClaimRow& row : claim_rows(claim)) {
    const Scope scope = claim.row_scope(*row.table, row.row);
    for (const ClaimSeries& s : series) {
      const std::size_t column = row.table->column(s.column, claim.at());
      const Unit& unit = row.table->columns[column].unit;
      const double measured = row.table->si(row.row, column, claim.at());
      if (measured == 0.0) throw bad_input(claim.at(), "a measured 0", "data other than 0");
      const double model = claim.evaluate(s.expression, scope);
      const double misfit = (model - measured) / std::abs(measured);
      squared += misfit * misfit;
      ++data;
      if (std::abs(misfit) > std::abs(worst)) worst = misfit;
      finding.details.push_back({fmt::format("{}, {}", row.words, s.column),
                                 with_unit(row.table->rows[row.row][column], unit),
                                 {model / unit.to_si, unit},
                                 "misfit " + percent_text(100.0 * misfit, 1),
                                 100.0 * misfit});
    }
  }
  finding.expression = expressions(series);
  finding.printed = fmt::format("{} data", data);
  finding.difference_percent = 100.0 * worst;
  finding.recomputed = {100.0 * worst, percent};
  if (!claim->relative_error) return;
  const double sigma = claim.quantity(*claim->relative_error, claim.scope());
  if (!(sigma > 0.0)) throw bad_input(claim.at(), "'relative_error' is not above 0", "e.g. 10 %");
  const double limit = chi_squared_quantile(0.95, data);
  finding.recomputed = {squared / (sigma * sigma), plain};
  finding.bound = {limit, plain};
  finding.verdict =
      squared / (sigma * sigma) <= limit ? AuditVerdict::holds : AuditVerdict::contradicted;
}

}  // namespace tpm::paper
