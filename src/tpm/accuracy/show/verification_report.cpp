#include "tpm/accuracy/show/verification_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/result_table.hpp"
#include "tpm/show/run_record.hpp"

namespace tpm::accuracy {
namespace {

std::string verdict_of(const VerificationRow& row) {
  return row.holds() ? "holds" : "FAILS";
}

/// "4 ± 0.1", "0 ± 1e-07".
std::string expected_words(const VerificationRow& row) {
  return row.expected == 0.0
             ? fmt::format("at most {}", significant(row.tolerance, 2))
             : fmt::format("{} ± {}", significant(row.expected, 3), significant(row.tolerance, 2));
}

std::string measured_words(const VerificationRow& row) {
  return row.failure.empty() ? significant(row.measured, 3) : row.failure;
}

std::string summary_of_group(const std::string& name) {
  for (const VerificationGroup& group : verification_groups()) {
    if (group.name == name) return std::string(group.summary);
  }
  return {};
}

Tone tone_of(const VerificationRow& row) {
  return row.holds() ? Tone::good : Tone::bad;
}

/// The method alone where the caption of its table names the problem.
std::string method_words(const VerificationRow& row) {
  const std::string end = ", " + row.problem;
  if (row.problem.empty() || !row.what.ends_with(end)) return row.what;
  return row.what.substr(0, row.what.size() - end.size());
}

const ResultTable<VerificationRow>& verification_table() {
  using Row = VerificationRow;
  using Of = ResultColumn<Row>;
  const auto measured = [](const Row& row) { return Cell{measured_words(row), tone_of(row)}; };
  const auto required = [](const Row& row) { return Cell{expected_words(row)}; };
  const auto verdict = [](const Row& row) { return Cell{verdict_of(row), tone_of(row)}; };
  const auto method = [](const Row& row) { return Cell{method_words(row)}; };
  static const ResultTable<Row> table(
      {Of("group", &Row::group), Of("what", &Row::what).shown("method").in_words(method),
       Of("quantity", &Row::quantity).shown("quantity"),
       Of("measured", &Row::measured).or_left_out().shown("measured", 1).in_words(measured),
       Of("expected", &Row::expected, 0).shown("required", 1).in_words(required),
       Of("tolerance", &Row::tolerance, 0), Of("failure", &Row::failure).or_left_out(),
       Of("holds", &Row::holds).shown("verdict").in_words(verdict),
       Of("reference", &Row::source).shown("reference")});
  return table;
}

/// Moves a column whose cells are all the same from a table of several rows into its caption.
void lift_column(Table& table, const std::string& title) {
  const auto found = std::ranges::find(table.columns, title, &Column::title);
  if (table.rows.size() < 2 || found == table.columns.end()) return;
  const auto at = found - table.columns.begin();
  const std::string& text = table.rows.front()[static_cast<std::size_t>(at)].text;
  const auto same = [&](const std::vector<Cell>& row) {
    return row[static_cast<std::size_t>(at)].text == text;
  };
  if (!std::ranges::all_of(table.rows, same)) return;
  std::string label = title;
  label.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(label.front())));
  table.caption += fmt::format("{}{}: {}.", table.caption.empty() ? "" : " ", label, text);
  table.columns.erase(found);
  for (std::vector<Cell>& row : table.rows) row.erase(row.begin() + at);
}

/// The checks of one problem, or those of a group that share none.
Table problem_table(const std::string& problem, const std::vector<VerificationRow>& rows) {
  Table table = verification_table().page(problem.empty() ? "" : problem + ".", rows);
  if (problem.empty()) table.columns.front().title = "what is verified";
  for (const char* title : {"reference", "quantity", "required"}) lift_column(table, title);
  return table;
}

std::string flaw_words(double flaw) {
  return fmt::format(
      "One coefficient of what is verified was made wrong by {} % on purpose; every check should "
      "fail.",
      significant(100.0 * flaw, 3));
}

/// "orders: 41 of 41 hold" of each group.
std::vector<VerificationLine> group_lines(const VerificationRun& verification) {
  std::vector<VerificationLine> lines;
  for (const std::string& name : each_once(verification.rows, &VerificationRow::group)) {
    std::size_t all = 0, held = 0;
    for (const VerificationRow& row : verification.rows) {
      if (row.group != name) continue;
      ++all;
      held += row.holds() ? 1 : 0;
    }
    lines.push_back({fmt::format("{}: {} of {} hold", name, held, all), held != all});
  }
  return lines;
}

Document verification_document(const VerificationRun& verification) {
  Document document;
  document.title = "Verification of tpm";
  document.subtitle = "What this program computes beside what is known otherwise";
  document.heading(2, "Summary");
  std::vector<Cell> items{
      {verification_words(verification), verification.failed() == 0 ? Tone::good : Tone::bad}};
  if (verification.flaw != 0.0) items.push_back({flaw_words(verification.flaw), Tone::bad});
  for (VerificationLine& line : group_lines(verification)) {
    items.push_back({std::move(line.text), line.failed ? Tone::bad : Tone::good});
  }
  document.bullets(std::move(items));
  document.paragraph(
      "A check holds if the measured value is within the tolerance of the required one. An "
      "observed order is log2 of the error at one step over that at half of it; the reference was "
      "never computed by the method that is verified. `tpm accuracy verify` runs all of it.");
  for (const std::string& name : each_once(verification.rows, &VerificationRow::group)) {
    std::string summary = summary_of_group(name);
    document.heading(2, fmt::format("{}: {}", name, summary));
    std::vector<VerificationRow> rows = verification.rows;
    std::erase_if(rows, [&](const VerificationRow& row) { return row.group != name; });
    for (const std::string& problem : each_once(rows, &VerificationRow::problem)) {
      std::vector<VerificationRow> shared = rows;
      std::erase_if(shared, [&](const VerificationRow& row) { return row.problem != problem; });
      document.table(problem_table(problem, shared));
    }
  }
  typeset(document);
  return document;
}

}  // namespace

std::string verification_words(const VerificationRun& verification) {
  const std::size_t failed = verification.failed();
  return failed == 0 ? fmt::format("{} checks: all hold.", verification.rows.size())
                     : fmt::format("{} checks: {} FAILED.", verification.rows.size(), failed);
}

std::vector<VerificationLine> brief_lines(const VerificationRun& verification) {
  constexpr std::size_t kMostShown = 12;
  std::vector<VerificationLine> lines{
      {verification_words(verification) + "\n", verification.failed() > 0}};
  if (verification.flaw != 0.0) lines.push_back({flaw_words(verification.flaw) + "\n", true});
  for (VerificationLine& line : group_lines(verification)) {
    lines.push_back({"  " + line.text + "\n", line.failed});
  }
  std::size_t shown = 0;
  for (const VerificationRow& row : verification.rows) {
    if (row.holds() || shown++ >= kMostShown) continue;
    lines.push_back({fmt::format("{}  {}: {}: {}, required {}\n", verdict_of(row), row.what,
                                 row.quantity, measured_words(row), expected_words(row)),
                     true});
  }
  if (shown > kMostShown) {
    lines.push_back({fmt::format("... and {} more FAIL\n", shown - kMostShown), true});
  }
  return lines;
}

std::vector<VerificationLine> verification_lines(const VerificationRun& verification) {
  std::vector<VerificationLine> lines;
  for (const std::string& name : each_once(verification.rows, &VerificationRow::group)) {
    if (!lines.empty()) lines.push_back({"\n"});
    lines.push_back({fmt::format("{}: {}\n", name, summary_of_group(name))});
    for (const VerificationRow& row : verification.rows) {
      if (row.group != name) continue;
      lines.push_back(
          {fmt::format("  {}  {}\n         {}: {}, required {}\n         reference: {}\n",
                       verdict_of(row), row.what, row.quantity, measured_words(row),
                       expected_words(row), row.source),
           !row.holds()});
    }
  }
  lines.push_back({"\n" + verification_words(verification) + "\n", verification.failed() > 0});
  if (verification.flaw != 0.0) lines.push_back({flaw_words(verification.flaw) + "\n", true});
  return lines;
}

Json to_json(const VerificationRun& verification) {
  Json json{{"checks", verification.rows.size()},
            {"failed", verification.failed()},
            {"holds", verification.failed() == 0},
            {"rows", verification_table().list(verification.rows)}};
  if (verification.flaw != 0.0) json["flaw"] = verification.flaw;
  return json;
}

std::string verification_csv(const VerificationRun& verification) {
  return verification_table().csv(verification.rows);
}

void write_verification(const VerificationRun& verification, const std::filesystem::path& folder,
                        double seconds) {
  const Document document = verification_document(verification);
  write_file(folder / "report.md", to_markdown(document));
  write_file(folder / "report.html", to_html(document, {}));
  write_file(folder / "verification.json", to_text(to_json(verification)));
  write_file(folder / "verification.csv", verification_csv(verification));
  write_file(folder / "report.run.json", to_text(run_record({{"checks", seconds}})));
}

}  // namespace tpm::accuracy
