// Declared in tpm/fit/predict/error_budget.hpp.
// Output of a budget: JSON, terminal, short answer, CSV.
#include <fmt/format.h>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/plan/perception.hpp"
#include "tpm/show/result_table.hpp"

namespace tpm::fit {
namespace {

Json thresholds() {
  const auto entry = [](const char* of, double share, const char* source) {
    return Json{{"of", of}, {"share", share}, {"source", source}};
  };
  return Json::array({entry("force between thumb and finger", kForceJnd, "Pang, Tan, Durlach 1991"),
                      entry("stiffness of silicone that is touched", kStiffnessTouched,
                            "Bergmann Tiest, Kappers 2009, doi 10.1109/TOH.2009.16"),
                      entry("stiffness through a tool", kStiffnessThroughTool,
                            "Bergmann Tiest, Kappers 2009: more than trebled"),
                      entry("viscosity by forced choice", kViscosityJnd,
                            "Jones, Hunter, Lafontaine, Perception 26 (1997) 1571"),
                      entry("viscosity by adjustment", kViscosityAdjusted,
                            "Jones, Hunter, Lafontaine, Perception 26 (1997) 1571")});
}

std::string in_percent(double part) {
  return significant(100.0 * part, 3);
}

const ResultTable<BudgetLine>& line_table() {
  using Row = BudgetLine;
  using Of = ResultColumn<Row>;
  const auto kind = [](const Row& line) { return budget_kind_name(line.kind); };
  const auto way = [](const Row& l) { return Cell{fmt::format("{} -> {}", l.from, l.to)}; };
  const auto compared = [](const Row& line) { return line.largest >= kLeastLine; };
  const auto small = [compared](const Row& l) { return Cell{compared(l) ? "" : "(below 0.1 %)"}; };
  static const ResultTable<Row> table(
      {Of("name", &Row::name).shown("line", -16), Of("kind", kind).shown("kind", -12),
       Of("from", &Row::from).shown("from -> to", -24).in_words(way), Of("to", &Row::to),
       Of("largest", &Row::largest).shown("largest", 9, 0.01, 3),
       Of("largest_at_s", &Row::largest_at_s), Of("rms", &Row::rms).shown("rms", 9, 0.01, 3),
       Of("compared", compared).shown("").in_words(small)});
  return table;
}

/// Each sum of the lines, in its words.
std::vector<std::pair<std::string, double>> sums_of(const ErrorBudget& b, bool with_draws) {
  std::vector<std::pair<std::string, double>> sums{{"largest sum of all lines", b.total}};
  if (b.random) {
    sums.emplace_back(
        fmt::format("parameters, {} % band{}", in_percent(b.random->level),
                    with_draws ? fmt::format(" from {} drawn laws", b.random->samples) : ""),
        b.random->largest);
  }
  if (b.instrument) {
    sums.emplace_back(
        fmt::format("instrument {}, {} %", b.instrument->id, in_percent(b.instrument->level)),
        b.instrument->largest);
  }
  sums.emplace_back(b.instrument ? "all in quadrature" : "both in quadrature", b.combined);
  return sums;
}

}  // namespace

Json to_json(const ErrorBudget& b) {
  const auto stored = [](double value) { return rounded(value); };
  const auto stage = [&](const BudgetStage& s) {
    return Json{
        {"name", s.name}, {"summary", s.summary}, {"force_N", array_json(s.force_N, stored)}};
  };
  Json json{{"title", b.title},
            {"peak_N", stored(b.peak_N)},
            {"lines", line_table().list(b.lines)},
            {"total", stored(b.total)},
            {"not_closed", b.not_closed}};
  if (b.random) {
    json["random"] = {{"largest", stored(b.random->largest)},
                      {"level", b.random->level},
                      {"samples", b.random->samples}};
  }
  if (b.instrument) {
    json["instrument"] = {{"id", b.instrument->id},
                          {"level", b.instrument->level},
                          {"largest", stored(b.instrument->largest)}};
  }
  json["combined"] = stored(b.combined);
  json["data_part"] = stored(b.data_part);
  json["computed_part"] = stored(b.computed_part);
  json["thresholds"] = thresholds();
  json["sentences"] = remarks_json(b.sentences);
  json["remarks"] = remarks_json(b.remarks);
  json["time_s"] = b.time_s;
  json["stages"] = array_json(b.stages, stage);
  return json;
}

std::string to_terminal_text(const ErrorBudget& b) {
  std::string text =
      fmt::format("{}, peak {}; in % of it\n\n{}", b.title,
                  sized_text(Dimension::force, b.peak_N, 4), line_table().text(b.lines));
  for (const auto& [words, part] : sums_of(b, true)) {
    text += fmt::format("{:<54} {:>9}\n", words, in_percent(part));
  }
  text += "\n";
  for (const Remark& sentence : b.sentences) text += sentence.text + "\n";
  text += "\njust noticeable differences:";
  for (const Json& t : thresholds()) {
    text += fmt::format("\n  {:>4} %  {} ({})", in_percent(t.at("share").get<double>()),
                        t.at("of").get<std::string>(), t.at("source").get<std::string>());
  }
  text += "\n";
  for (const Remark& remark : b.remarks) text += fmt::format("! {}\n", remark.text);
  return text;
}

ShortAnswer short_answer(const ErrorBudget& b) {
  const auto percent = [](double part) { return in_percent(part) + " %"; };
  ShortAnswer answer;
  answer.conclusion = remark_texts(b.sentences);
  answer.conclusion.insert(
      answer.conclusion.begin(),
      fmt::format("{}: peak {}", b.title, sized_text(Dimension::force, b.peak_N, 4)));
  answer.head = {
      fmt::format("{:<40} {:>12} {:>12}", "changed by, in parts of the peak", "largest", "rms")};
  for (const BudgetLine& line : b.lines) {
    answer.rows.push_back(fmt::format(
        "{:<40} {:>12} {:>12}{}", fmt::format("{} ({})", line.name, budget_kind_name(line.kind)),
        percent(line.largest), percent(line.rms),
        line.largest < kLeastLine ? "  (below 0.1 %)" : ""));
  }
  for (const auto& [words, part] : sums_of(b, false)) {
    answer.limits.push_back(fmt::format("{:<40} {:>12}", words, percent(part)));
  }
  answer.limits.push_back(
      fmt::format("just noticeable differences: {} of a force, {} of a stiffness that is touched, "
                  "{} of one felt through a tool",
                  percent(kForceJnd), percent(kStiffnessTouched), percent(kStiffnessThroughTool)));
  answer.warnings = remark_texts(b.remarks);
  return answer;
}

std::string to_csv(const ErrorBudget& b) {
  NumberColumns columns{{"time_s", b.time_s}};
  for (const BudgetStage& s : b.stages) columns.emplace_back(s.name + "_N", s.force_N);
  for (const BudgetLine& line : b.lines) {
    columns.emplace_back(fmt::format("line_{}_N", line.name), line.difference_N);
  }
  constexpr int kDigits = 12;
  return numbers_csv(columns, kDigits);
}

}  // namespace tpm::fit
