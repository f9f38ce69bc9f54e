#include "tpm/paper/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/model.hpp"

namespace tpm::paper {
namespace {

struct Forces {
  double peak_N;
  double end_N;
};

/// Forces at the two instants of the table, with lambda1 given.
Forces forces(const TableRequest& request, const TpmParameters& p, double depth_m, double lambda1) {
  if (request.mode == TableMode::as_printed) {
    constexpr double kAfterAll_s = std::numeric_limits<double>::infinity();
    return {step_relaxation_force_N(p, lambda1, depth_m, 0.0),
            step_relaxation_force_N(p, lambda1, depth_m, kAfterAll_s)};
  }
  // Frozen or not makes no difference here: both instants have the full depth.
  ModelOptions options;
  options.tension = TensionRule::frozen(lambda1);
  const Protocol protocol = ramp_and_hold(depth_m, request.rate_m_per_s, request.hold_s);
  const std::array times{depth_m / request.rate_m_per_s, protocol.end_s()};
  const Response response =
      make_model("closed_form", options)->respond(protocol, times, to_vector(p), Want::values);
  return {response.value[0], response.value[1]};
}

bool same(double a, double b) {
  return std::abs(a - b) <= 1e-9 * std::max(std::abs(a), std::abs(b));
}

/// A row of a printed table with the places of the columns that are asked for.
class PrintedRow {
 public:
  PrintedRow(const PrintedTable& table, std::size_t row) : table_(&table), row_(row) {}

  [[nodiscard]] double si(std::string_view column) const {
    return table_->si(row_, table_->column(column, table_->id), table_->id);
  }
  [[nodiscard]] const std::string& text(std::string_view column) const {
    return table_->rows[row_][table_->column(column, table_->id)];
  }
  [[nodiscard]] const Unit& unit(std::string_view column) const {
    return table_->columns[table_->column(column, table_->id)].unit;
  }
  [[nodiscard]] const std::string& where() const { return table_->where; }

  /// Of a column of that name, else of a constant of the table.
  [[nodiscard]] double column_or_constant(std::string_view name) const {
    if (table_->has_column(name)) return si(name);
    for (const auto& [constant, value] : table_->constants) {
      if (constant == name) return parse_quantity(value, Dimension::length, table_->id);
    }
    throw bad_input(table_->id, fmt::format("says nothing of '{}'", name),
                    "a column or a constant of that name");
  }

 private:
  const PrintedTable* table_;
  std::size_t row_;
};

std::optional<PrintedRow> find_row(const std::vector<PrintedTable>& tables, std::string_view kind,
                                   double depth_m, std::optional<double> spacing_m) {
  for (const PrintedTable& table : tables) {
    if (table.kind != kind) continue;
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      const PrintedRow row(table, r);
      if (!same(row.column_or_constant("depth"), depth_m)) continue;
      if (!spacing_m || same(row.column_or_constant("x"), *spacing_m)) return row;
    }
  }
  return std::nullopt;
}

DigitCheck check_cell(const PrintedRow& row, std::string_view column, double si) {
  return compare_digits(parse_printed(row.text(column), row.where()), si / row.unit(column).to_si);
}

PrintedCell printed_cell(const PrintedRow& row, std::string_view column, double from_computed,
                         std::optional<double> from_printed) {
  PrintedCell cell;
  cell.unit = row.unit(column);
  cell.from_computed_lambda1 = check_cell(row, column, from_computed);
  if (from_printed) cell.from_printed_lambda1 = check_cell(row, column, *from_printed);
  return cell;
}

MeasuredCell measured_cell(const PrintedRow& row, std::string_view column, double model_si) {
  MeasuredCell cell{row.text(column), row.unit(column), row.si(column), 0.0};
  cell.misfit_percent = 100.0 * (model_si - cell.si) / cell.si;
  return cell;
}

TableRow make_row(const TableRequest& request, const std::vector<PrintedTable>& tables,
                  double depth_m, double spacing_m) {
  TpmParameters p = request.parameters;
  p.spacing_m = spacing_m;
  TableRow row;
  row.depth_m = depth_m;
  row.spacing_m = spacing_m;
  row.lambda1.value = lambda1_Pa(p.Eprime_Pa, depth_m, spacing_m);
  const Forces computed = forces(request, p, depth_m, row.lambda1.value);
  row.peak_force.value = computed.peak_N;
  row.end_force.value = computed.end_N;
  const auto printed = find_row(tables, "relaxation", depth_m, spacing_m);
  if (!printed) return row;
  row.printed_where = printed->where();
  const Forces from_printed = forces(request, p, depth_m, printed->si("lambda1"));
  row.lambda1.printed = printed_cell(*printed, "lambda1", row.lambda1.value, std::nullopt);
  row.peak_force.printed = printed_cell(*printed, "peak", computed.peak_N, from_printed.peak_N);
  row.end_force.printed = printed_cell(*printed, "end", computed.end_N, from_printed.end_N);
  row.peak_force.measured = measured_cell(*printed, "measured_peak", computed.peak_N);
  row.end_force.measured = measured_cell(*printed, "measured_end", computed.end_N);
  return row;
}

std::optional<BandRow> make_band(const TableRequest& request,
                                 const std::vector<PrintedTable>& tables, double depth_m) {
  const auto printed = find_row(tables, "static_band", depth_m, std::nullopt);
  if (!printed) return std::nullopt;
  BandRow row;
  TpmParameters p = request.parameters;
  p.spacing_m = printed->column_or_constant("x");
  row.depth_m = depth_m;
  row.spacing_m = p.spacing_m;
  row.printed_where = printed->where();
  row.lambda1.value = lambda1_Pa(p.Eprime_Pa, depth_m, p.spacing_m);
  row.force.value = forces(request, p, depth_m, row.lambda1.value).end_N;
  const double from_printed = forces(request, p, depth_m, printed->si("lambda1")).end_N;
  row.lambda1.printed = printed_cell(*printed, "lambda1", row.lambda1.value, std::nullopt);
  row.force.printed = printed_cell(*printed, "force", row.force.value, from_printed);
  row.band_low = printed->text("band_low");
  row.band_high = printed->text("band_high");
  row.band_unit = printed->unit("band_low");
  row.band_low_N = printed->si("band_low");
  row.band_high_N = printed->si("band_high");
  row.inside = row.band_low_N <= row.force.value && row.force.value <= row.band_high_N;
  return row;
}

void require_lengths(const std::vector<double>& lengths_m, std::string_view option) {
  if (lengths_m.empty()) throw bad_input(option, "no value", "at least one length");
  for (std::size_t i = 0; i < lengths_m.size(); ++i) {
    const double length = lengths_m[i];
    if (!(length > 0.0) || !std::isfinite(length)) {
      throw bad_input(option, fmt::format("{} mm", significant(length * 1e3, 6)),
                      "a length above 0");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (same(length, lengths_m[j])) {
        throw bad_input(option, fmt::format("{} mm stands twice", significant(length * 1e3, 6)),
                        "each length once");
      }
    }
  }
}

void require_valid(const TableRequest& request) {
  require_lengths(request.depths_m, "depths");
  require_lengths(request.spacings_m, "spacings");
  tpm::require_valid(request.parameters, "parameters");
  for (const auto& [value, name] :
       {std::pair{request.rate_m_per_s, "rate"}, {request.hold_s, "hold"}}) {
    if (!(value > 0.0) || !std::isfinite(value)) {
      throw bad_input(name, fmt::format("{} in SI units", shortest(value)), "a value above 0");
    }
  }
}

TableSummary summarise(const std::vector<TableRow>& rows) {
  TableSummary summary;
  for (const TableRow& row : rows) {
    if (row.lambda1.printed) summary.lambda1.add(row.lambda1.printed->from_computed_lambda1);
    for (const TableCell* force : {&row.peak_force, &row.end_force}) {
      if (!force->printed) continue;
      summary.force_from_computed_lambda1.add(force->printed->from_computed_lambda1);
      if (force->printed->from_printed_lambda1) {
        summary.force_from_printed_lambda1.add(*force->printed->from_printed_lambda1);
      }
    }
  }
  return summary;
}

}  // namespace

void CellCounts::add(const DigitCheck& check) {
  ++cells;
  switch (check.verdict) {
    case DigitVerdict::by_rounding:
      ++by_rounding;
      break;
    case DigitVerdict::by_truncation:
      ++by_truncation;
      break;
    case DigitVerdict::last_digit_off:
      ++last_digit_off;
      break;
    case DigitVerdict::differs:
      ++differ;
      break;
  }
}

namespace {

void require_finite(const TableRow& row) {
  const std::pair<const char*, double> cells[] = {{"lambda1", row.lambda1.value},
                                                  {"peak force", row.peak_force.value},
                                                  {"end force", row.end_force.value}};
  for (const auto& [name, value] : cells) {
    if (std::isfinite(value)) continue;
    throw Error(ExitCode::numerical, "tables",
                fmt::format("the {} at depth {} m and spacing {} m is not a finite number", name,
                            shortest(row.depth_m), shortest(row.spacing_m)),
                "depths, spacings and parameters of a tissue");
  }
}

}  // namespace

TablesResult make_tables(const TableRequest& request, const std::vector<PrintedTable>& printed) {
  require_valid(request);
  TablesResult result;
  result.request = request;
  for (const double depth : request.depths_m) {
    for (const double spacing : request.spacings_m) {
      result.rows.push_back(make_row(request, printed, depth, spacing));
      require_finite(result.rows.back());
    }
    if (auto band = make_band(request, printed, depth)) result.bands.push_back(std::move(*band));
  }
  result.summary = summarise(result.rows);
  return result;
}

}  // namespace tpm::paper
