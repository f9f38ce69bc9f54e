// Declared in tpm/paper/show/study_report.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/printed_number.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/paper/show/study_report.hpp"

namespace tpm::paper {
namespace {

/// Enough for any use, and the same on machines whose last bits differ.
std::string ten_digits(double value) {
  return significant(value, 10);
}

constexpr double kMillimetres = 1e3;
constexpr double kKilo = 1e-3;

std::string spacing_text(double metres) {
  return significant(metres * kMillimetres, 6) + " mm";
}

/// A line of a section: one quantity at one depth and spacing.
struct Line {
  std::string_view quantity;
  const TableCell* cell;
  double to_display;
  std::string_view unit;
};

std::vector<Line> lines_of(const TableRow& row) {
  return {{"lambda1", &row.lambda1, kKilo, "kPa"},
          {"peak force", &row.peak_force, 1.0, "N"},
          {"end force", &row.end_force, 1.0, "N"}};
}

std::string verdict_of(const std::optional<PrintedCell>& cell, bool from_printed) {
  if (!cell) return {};
  if (!from_printed) return cell->from_computed_lambda1.words();
  return cell->from_printed_lambda1 ? cell->from_printed_lambda1->words() : std::string{};
}

std::vector<std::string> printed_texts(const TableCell& cell) {
  if (!cell.printed) return {"", "", "", "", ""};
  const DigitCheck& check = cell.printed->from_computed_lambda1;
  const auto& other = cell.printed->from_printed_lambda1;
  const auto percent = check.window_percent();
  return {with_unit(check.printed.text, cell.printed->unit),
          percent ? fmt::format("{:.1f} %", *percent) : std::string{},
          verdict_of(cell.printed, false),
          other ? with_unit(significant(other->computed, 4), cell.printed->unit) : std::string{},
          verdict_of(cell.printed, true)};
}

std::vector<std::string> measured_texts(const TableCell& cell) {
  if (!cell.measured) return {"", ""};
  return {with_unit(cell.measured->text, cell.measured->unit),
          percent_text(cell.measured->misfit_percent, 1)};
}

/// The comparison columns that follow the computed ones.
TableSection new_section(std::string title, std::vector<std::string> first, bool with_printed) {
  TableSection section;
  section.title = std::move(title);
  section.columns = std::move(first);
  section.right_aligned = std::vector<bool>(section.columns.size(), true);
  if (with_printed) {
    for (const char* head : {"printed", "window", "verdict", "from printed l1", "verdict"}) {
      section.columns.emplace_back(head);
      section.right_aligned.push_back(std::string_view(head) != "verdict");
    }
  }
  return section;
}

TableSection depth_section(const TablesResult& result, double depth_m) {
  std::vector<const TableRow*> rows;
  for (const TableRow& row : result.rows) {
    if (row.depth_m == depth_m) rows.push_back(&row);
  }
  const auto printed = std::find_if(rows.begin(), rows.end(),
                                    [](const TableRow* r) { return !r->printed_where.empty(); });
  const bool compare = printed != rows.end();
  std::string title = "Depth " + spacing_text(depth_m);
  if (compare) title += fmt::format(" (paper: {})", (*printed)->printed_where);
  TableSection section = new_section(title, {"x", "quantity", "computed"}, compare);
  section.right_aligned[1] = false;
  if (compare) {
    section.columns.insert(section.columns.end(), {"measured", "misfit"});
    section.right_aligned.insert(section.right_aligned.end(), {true, true});
  }
  for (const TableRow* row : rows) {
    for (const Line& line : lines_of(*row)) {
      std::vector<std::string> cells{
          spacing_text(row->spacing_m), std::string(line.quantity),
          fmt::format("{} {}", significant(line.cell->value * line.to_display, 4), line.unit)};
      if (compare) {
        for (auto& text : printed_texts(*line.cell)) cells.push_back(std::move(text));
        for (auto& text : measured_texts(*line.cell)) cells.push_back(std::move(text));
      }
      section.rows.push_back(std::move(cells));
    }
  }
  return section;
}

TableSection band_section(const TablesResult& result) {
  const BandRow& first = result.bands.front();
  TableSection section =
      new_section(fmt::format("Equilibrium force and static band, x = {} (paper: {})",
                              spacing_text(first.spacing_m), first.printed_where),
                  {"depth", "equilibrium force"}, true);
  section.columns.insert(section.columns.end(), {"measured band", ""});
  section.right_aligned.insert(section.right_aligned.end(), {true, false});
  for (const BandRow& row : result.bands) {
    std::vector<std::string> cells{spacing_text(row.depth_m),
                                   significant(row.force.value, 4) + " N"};
    for (auto& text : printed_texts(row.force)) cells.push_back(std::move(text));
    cells.push_back(fmt::format("{} - {}", row.band_low, with_unit(row.band_high, row.band_unit)));
    cells.emplace_back(row.inside ? "inside" : "outside");
    section.rows.push_back(std::move(cells));
  }
  return section;
}

std::vector<std::string> introduction(const TableRequest& request) {
  const TpmParameters& p = request.parameters;
  std::vector<std::string> lines;
  lines.push_back(fmt::format("E1 = {} kPa, E2 = {} kPa, E' = {} kPa, A0 = {} mm^2, l0 = {}.",
                              significant(p.E1_Pa * kKilo, 6), significant(p.E2_Pa * kKilo, 6),
                              significant(p.Eprime_Pa * kKilo, 6), significant(p.A0_m2 * 1e6, 6),
                              spacing_text(p.l0_m)));
  if (request.mode == TableMode::as_printed) {
    lines.emplace_back(
        "As printed: a step (Eqs. 15 and 16); the end force is the limit t -> infinity.");
  } else {
    lines.push_back(fmt::format(
        "Consistent: ramp at {} mm/s (assumed: the tables state no rate), then {} s of "
        "hold counted "
        "from the end of the ramp (assumed); eta1 = {} Pa s, tau = {} s.",
        significant(request.rate_m_per_s * kMillimetres, 6), significant(request.hold_s, 6),
        significant(p.eta1_Pa_s, 6), significant(p.relaxation_time_s(), 4)));
  }
  return lines;
}

std::string counts_text(std::string_view what, const CellCounts& c) {
  return fmt::format(
      "{}: {} of {} explained ({} by rounding, {} by truncation); {} last digit off, {} differ.",
      what, c.explained(), c.cells, c.by_rounding, c.by_truncation, c.last_digit_off, c.differ);
}

std::vector<std::string> csv_cells(std::string_view quantity, double depth_m, double spacing_m,
                                   const std::string& where, const TableCell& cell,
                                   std::string_view si_unit) {
  std::vector<std::string> cells{where,
                                 ten_digits(depth_m),
                                 ten_digits(spacing_m),
                                 std::string(quantity),
                                 ten_digits(cell.value),
                                 std::string(si_unit)};
  const bool printed = cell.printed.has_value();
  const DigitCheck check = printed ? cell.printed->from_computed_lambda1 : DigitCheck{};
  const auto& other = printed ? cell.printed->from_printed_lambda1 : std::nullopt;
  const double to_si = printed ? cell.printed->unit.to_si : 1.0;
  cells.push_back(check.printed.text);
  cells.push_back(printed ? cell.printed->unit.symbol : std::string{});
  cells.push_back(printed ? ten_digits(check.window_width() * to_si) : std::string{});
  cells.push_back(printed ? std::string(verdict_name(check.verdict)) : std::string{});
  cells.push_back(other ? ten_digits(other->computed * to_si) : std::string{});
  cells.push_back(other ? std::string(verdict_name(other->verdict)) : std::string{});
  cells.push_back(cell.measured ? cell.measured->text : std::string{});
  cells.push_back(cell.measured ? ten_digits(cell.measured->misfit_percent) : std::string{});
  return cells;
}

/// "0.3024 N", and "0.3024 N, not 0.301" where the printed digits do not follow: a force from the
/// printed lambda1, as the paper computed it.
std::string cell_words(const TableCell& cell, double to_display, std::string_view unit) {
  std::string words = fmt::format("{} {}", significant(cell.value * to_display, 4), unit);
  if (!cell.printed) return words;
  const DigitCheck& check =
      cell.printed->from_printed_lambda1.value_or(cell.printed->from_computed_lambda1);
  CellCounts counts;
  counts.add(check);
  if (counts.explained() == 0) words += fmt::format(", not {}", check.printed.text);
  return words;
}

std::string short_row(const std::string& depth, const std::string& spacing,
                      const std::string& lambda1, const std::string& peak, const std::string& end) {
  return fmt::format("{:>8}  {:>8}  {:<22}  {:<22}  {}", depth, spacing, lambda1, peak, end);
}

std::string band_words(const std::vector<BandRow>& bands) {
  const auto inside = std::ranges::count_if(bands, &BandRow::inside);
  return fmt::format("Equilibrium forces at x = {}: {} of {} inside the measured band.",
                     spacing_text(bands.front().spacing_m), inside, bands.size());
}

}  // namespace

ShortAnswer short_answer(const TablesResult& result) {
  ShortAnswer answer;
  answer.conclusion = {fmt::format("{}", fmt::join(introduction(result.request), " "))};
  answer.head = {short_row("depth", "x", "lambda1", "peak force", "end force")};
  for (const TableRow& row : result.rows) {
    const std::vector<Line> lines = lines_of(row);
    std::vector<std::string> cells;
    for (const Line& line : lines) {
      cells.push_back(cell_words(*line.cell, line.to_display, line.unit));
    }
    answer.rows.push_back(short_row(spacing_text(row.depth_m), spacing_text(row.spacing_m),
                                    cells[0], cells[1], cells[2]));
  }
  answer.rest = [count = answer.rows.size()](std::size_t from) {
    return fmt::format("... and {} more rows, counted below", count - from);
  };
  const TableSummary& s = result.summary;
  if (s.lambda1.cells == 0) return answer;
  answer.limits = {counts_text("lambda1", s.lambda1),
                   counts_text("Forces from the printed lambda1", s.force_from_printed_lambda1),
                   counts_text("Forces from the computed lambda1", s.force_from_computed_lambda1)};
  if (!result.bands.empty()) answer.limits.back() += " " + band_words(result.bands);
  return answer;
}

TableDocument tables_document(const TablesResult& result) {
  TableDocument document;
  document.title = "Relaxation tables";
  document.introduction = introduction(result.request);
  for (const double depth : result.request.depths_m) {
    document.sections.push_back(depth_section(result, depth));
  }
  if (!result.bands.empty()) document.sections.push_back(band_section(result));
  const TableSummary& s = result.summary;
  if (s.lambda1.cells == 0) return document;
  document.conclusion = {
      counts_text("lambda1", s.lambda1),
      counts_text("Forces from the printed lambda1 (l1)", s.force_from_printed_lambda1),
      counts_text("Forces from the computed lambda1", s.force_from_computed_lambda1),
      "window: width of the interval of values that rounding or truncation turns into the printed "
      "digits, relative to the printed value."};
  return document;
}

std::string tables_csv(const TablesResult& result) {
  std::string out =
      csv_line({"printed_where", "depth_m", "spacing_m", "quantity", "computed_SI", "unit_SI",
                "printed", "printed_unit", "window_width_SI", "verdict", "from_printed_lambda1_SI",
                "from_printed_lambda1_verdict", "measured", "misfit_percent"});
  for (const TableRow& row : result.rows) {
    for (const Line& line : lines_of(row)) {
      const std::string_view si_unit = line.quantity == "lambda1" ? "Pa" : "N";
      out += csv_line(csv_cells(line.quantity, row.depth_m, row.spacing_m, row.printed_where,
                                *line.cell, si_unit));
    }
  }
  for (const BandRow& row : result.bands) {
    auto cells = csv_cells("equilibrium force", row.depth_m, row.spacing_m, row.printed_where,
                           row.force, "N");
    cells[cells.size() - 2] = fmt::format("{} - {}", row.band_low, row.band_high);
    out += csv_line(cells);
  }
  return out;
}

}  // namespace tpm::paper
