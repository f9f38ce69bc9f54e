#include "tpm/accuracy/show/verification_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/run_record.hpp"
#include "tpm/show/table_document.hpp"

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

Table table_of_group(const VerificationRun& verification, const std::string& name) {
  Table table{"",
              {{"what is verified"},
               {"quantity"},
               {"measured", true},
               {"required", true},
               {"verdict"},
               {"reference"}}};
  for (const VerificationRow& row : verification.rows) {
    if (row.group != name) continue;
    const Tone tone = row.holds() ? Tone::good : Tone::bad;
    table.rows.push_back({{row.what},
                          {row.quantity},
                          {measured_words(row), tone},
                          {expected_words(row)},
                          {verdict_of(row), tone},
                          {row.source}});
  }
  return table;
}

std::string flaw_words(double flaw) {
  return fmt::format(
      "One coefficient of what is verified was made wrong by {} % on purpose; every check should "
      "fail.",
      significant(100.0 * flaw, 3));
}

Document verification_document(const VerificationRun& verification) {
  Document document;
  document.title = "Verification of tpm";
  document.subtitle = "What this program computes beside what is known otherwise";
  document.heading(2, "Summary");
  std::vector<Cell> items{
      {verification_words(verification), verification.failed() == 0 ? Tone::good : Tone::bad}};
  if (verification.flaw != 0.0) items.push_back({flaw_words(verification.flaw), Tone::bad});
  for (const std::string& name : each_once(verification.rows, &VerificationRow::group)) {
    std::size_t all = 0, held = 0;
    for (const VerificationRow& row : verification.rows) {
      if (row.group != name) continue;
      ++all;
      held += row.holds() ? 1 : 0;
    }
    items.push_back(
        {fmt::format("{}: {} of {} hold", name, held, all), held == all ? Tone::good : Tone::bad});
  }
  document.bullets(std::move(items));
  document.paragraph(
      "A check holds if the measured value is within the tolerance of the required one. An "
      "observed order is log2 of the error at one step over that at half of it; the reference was "
      "never computed by the method that is verified. `tpm accuracy verify` runs all of it.");
  for (const std::string& name : each_once(verification.rows, &VerificationRow::group)) {
    std::string summary = summary_of_group(name);
    document.heading(2, fmt::format("{}: {}", name, summary));
    document.table(table_of_group(verification, name));
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
  constexpr int kKeptDigits = 6;
  Json json{{"checks", verification.rows.size()},
            {"failed", verification.failed()},
            {"holds", verification.failed() == 0},
            {"rows", Json::array()}};
  if (verification.flaw != 0.0) json["flaw"] = verification.flaw;
  for (const VerificationRow& row : verification.rows) {
    Json entry{{"group", row.group},      {"what", row.what},         {"quantity", row.quantity},
               {"reference", row.source}, {"expected", row.expected}, {"tolerance", row.tolerance}};
    if (std::isfinite(row.measured)) entry["measured"] = rounded(row.measured, kKeptDigits);
    if (!row.failure.empty()) entry["failure"] = row.failure;
    entry["holds"] = row.holds();
    json["rows"].push_back(std::move(entry));
  }
  return json;
}

std::string verification_csv(const VerificationRun& verification) {
  std::string text = csv_line(
      {"group", "what", "quantity", "measured", "expected", "tolerance", "verdict", "reference"});
  for (const VerificationRow& row : verification.rows) {
    text +=
        csv_line({row.group, row.what, row.quantity,
                  row.failure.empty() ? significant(row.measured, 6) : "", shortest(row.expected),
                  shortest(row.tolerance), row.holds() ? "holds" : "fails", row.source});
  }
  return text;
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
