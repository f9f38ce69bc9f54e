#include "tpm/accuracy/show/stability_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/result_table.hpp"

namespace tpm::accuracy {
namespace {

std::string number(double value) {
  return std::isfinite(value) ? significant(value, 4) : "";
}

std::string percent(double share) {
  return fmt::format("{} %", significant(100.0 * share, 2));
}

constexpr double kOnlyRounding = 1e-12;  // an error below it is only rounding

/// "holds, 0.012 %", "diverged".
std::string verdict_words(const StabilityVerdict& v) {
  std::string name(stability_class_name(v.found));
  if (!std::isfinite(v.error)) return name;
  return name + ", " + (v.error < kOnlyRounding ? "exact" : percent(v.error));
}

/// The same in a table of a page, whose introduction says that a number alone means "holds" and
/// that its unit is %: "0.012", "exact", "diverged".
std::string short_words(const StabilityVerdict& v) {
  std::string name(stability_class_name(v.found));
  if (!std::isfinite(v.error)) return name;
  const std::string error = v.error < kOnlyRounding ? "exact" : significant(100.0 * v.error, 2);
  return v.found == StabilityClass::holds ? error : name + ", " + error;
}

constexpr const char* kShortWords =
    "Numbers are errors in % of the peak; a number or 'exact' alone: the rule holds.";

const ResultTable<StabilityLimit>& limits_table() {
  using Row = StabilityLimit;
  using Of = ResultColumn<Row>;
  const auto found = [](const Row& l) {
    return Cell{std::isfinite(l.found_s) ? number(l.found_s) : "not found"};
  };
  const auto ratio = [](const Row& l) {
    const bool good = std::abs(l.ratio() - 1.0) <= 0.02;
    return Cell{number(l.ratio()), good ? Tone::good : Tone::bad};
  };
  static const ResultTable<Row> table(
      {Of("problem", &Row::problem).shown("problem"),
       Of("rule", [](const Row& l) { return step_rule_name(l.rule); }).shown("rule"),
       Of("theory", &Row::theory).shown("theory"),
       Of("theory_s", &Row::theory_s).shown("theory, s", 1),
       Of("found_s", &Row::found_s, 4).or_left_out().shown("found, s", 1).in_words(found),
       Of("found_over_theory", &Row::ratio, 4)
           .or_left_out()
           .shown("found/theory", 1)
           .in_words(ratio)});
  return table;
}

/// Outcome of a rule in a cell of either kind.
template <class Row>
std::vector<ResultColumn<Row>> verdict_columns() {
  return {{"rule", [](const Row& c) { return step_rule_name(c.rule); }},
          {"class", [](const Row& c) { return stability_class_name(c.verdict.found); }},
          ResultColumn<Row>(
              "error_of_peak", [](const Row& c) { return c.verdict.error; }, 4)
              .or_left_out()};
}

std::vector<ResultColumn<LimitingCell>> limiting_columns() {
  using Row = LimitingCell;
  std::vector<ResultColumn<Row>> columns = verdict_columns<Row>();
  columns.emplace_back("expected", [](const Row& c) { return stability_class_name(c.expected); });
  columns.emplace_back("right", &Row::right);
  columns.emplace_back("reason", [](const Row& c) { return c.verdict.reason; }).or_left_out();
  return columns;
}

const ResultTable<ServoRow> kServoRows({{"problem", &ServoRow::problem},
                                        {"rate_Hz", &ServoRow::rate_Hz}});
const ResultTable<ServoCell> kServoCells(verdict_columns<ServoCell>());
const ResultTable<LimitingCase> kLimitingCases({{"case", &LimitingCase::name}});
const ResultTable<LimitingCell> kLimitingCells(limiting_columns());

Table servo_table(const StabilityStudy& study, const std::string& problem) {
  Table table{problem, {{"rate, Hz", true}}};
  for (const ServoRow& row : study.servo) {
    if (row.problem != problem) continue;
    if (table.columns.size() == 1) {
      for (const ServoCell& cell : row.cells)
        table.columns.push_back({step_rule_name(cell.rule), true});
    }
    std::vector<Cell> cells{{significant(row.rate_Hz, 4)}};
    for (const ServoCell& cell : row.cells) {
      const bool holds = cell.verdict.found == StabilityClass::holds;
      cells.push_back({short_words(cell.verdict), holds ? Tone::good : Tone::bad});
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

/// Motion and expected outcome, once for all cases that share both.
Table expectations_table(const StabilityStudy& study) {
  using Shared = std::pair<std::string, std::string>;
  const auto shared = [](const LimitingCase& c) { return Shared{c.setup, c.expected}; };
  Table table{"What is done in each case, and what is right.",
              {{"case"}, {"what is done"}, {"what is right"}}};
  for (const Shared& both : each_once(study.limiting_cases, shared)) {
    std::vector<LimitingCase> cases = study.limiting_cases;
    std::erase_if(cases, [&](const LimitingCase& c) { return shared(c) != both; });
    table.rows.push_back({{listed(cases, &LimitingCase::name, "; ")}, {both.first}, {both.second}});
  }
  return table;
}

Table limiting_cases_table(const StabilityStudy& study) {
  Table table{fmt::format("What the rules did, steps of 1 ms. {} An answer that is not the "
                          "expected one is marked.",
                          kShortWords),
              {{"case"}}};
  for (const StepRuleEntry& entry : kStepRules) table.columns.push_back({std::string(entry.text)});
  for (const LimitingCase& limiting_case : study.limiting_cases) {
    std::vector<Cell> row{{limiting_case.name}};
    for (const LimitingCell& cell : limiting_case.cells) {
      std::string words = short_words(cell.verdict);
      if (!cell.right) {
        words += fmt::format(" (not as expected: {})", stability_class_name(cell.expected));
      }
      row.push_back({std::move(words), cell.right ? Tone::good : Tone::bad});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::set<std::string> map_ids(const StabilityStudy& study) {
  std::set<std::string> ids;
  for (const StabilityMap& map : study.maps) ids.insert(map.id);
  return ids;
}

/// Of a map: runs above the limit of theory that hold, and runs below it that do not.
struct Disagreement {
  std::size_t runs = 0, hold_above = 0, fail_below = 0;
};

Disagreement disagreement(const StabilityMap& map) {
  constexpr double kMargin = 1.05;
  Disagreement d;
  for (std::size_t i = 0; i < map.limit_x.size(); ++i) {
    for (const StabilityPoint& p : map.points) {
      if (p.x != map.limit_x[i]) continue;
      ++d.runs;
      const bool grows = p.verdict.found == StabilityClass::diverged ||
                         p.verdict.found == StabilityClass::energy_grew;
      if (p.step_s > kMargin * map.limit_step_s[i] && !grows) ++d.hold_above;
      if (p.step_s * kMargin < map.limit_step_s[i] && grows) ++d.fail_below;
    }
  }
  return d;
}

/// Classes that some run of a map ended in.
std::vector<StabilityClassEntry> classes_found(const StabilityStudy& study) {
  std::vector<StabilityClassEntry> found;
  for (const StabilityClassEntry& entry : kStabilityClasses) {
    const auto in_map = [&](const StabilityMap& map) {
      return std::ranges::any_of(map.points,
                                 [&](const auto& p) { return p.verdict.found == entry.meaning; });
    };
    if (std::ranges::any_of(study.maps, in_map)) found.push_back(entry);
  }
  return found;
}

Table maps_table(const StabilityStudy& study) {
  const std::vector<StabilityClassEntry> classes = classes_found(study);
  Table table{
      "Runs of the maps by class; a class without a column has no run. The last two columns "
      "compare "
      "with the limit of linear theory (5 % around it left out), '-' where a rule has none: runs "
      "above it that did not grow, and runs below it that grew.",
      {{"map"}, {"rule"}}};
  for (const StabilityClassEntry& entry : classes) {
    table.columns.push_back({std::string(entry.text), true});
  }
  table.columns.push_back({"above, no growth", true});
  table.columns.push_back({"below, growth", true});
  for (const StabilityMap& map : study.maps) {
    std::vector<Cell> row{{map.quantity}, {step_rule_name(map.rule)}};
    for (const StabilityClassEntry& entry : classes) {
      const auto count = std::ranges::count_if(
          map.points, [&](const auto& p) { return p.verdict.found == entry.meaning; });
      row.push_back({std::to_string(count)});
    }
    const Disagreement d = disagreement(map);
    row.push_back({d.runs == 0 ? "-" : std::to_string(d.hold_above)});
    row.push_back({d.runs == 0 ? "-" : std::to_string(d.fail_below)});
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// The problem of each map, once for all rules.
Table problems_table(const StabilityStudy& study) {
  using MapProblem = std::pair<std::string, std::string>;
  const auto problem_of = [](const StabilityMap& map) {
    return MapProblem{map.quantity, map.problem};
  };
  Table table{"", {{"map of the step against"}, {"problem"}}};
  for (const MapProblem& both : each_once(study.maps, problem_of)) {
    table.rows.push_back({{both.first}, {both.second}});
  }
  return table;
}

/// "rk4: mass, drag"
std::string figure_title(const Figure& figure) {
  return figure.panels.empty() ? figure.title : listed(figure.panels, &Panel::title, "; ");
}

void add_maps(Document& document, const StabilityStudy& study, const std::vector<Figure>& figures) {
  document.heading(2, "Maps");
  document.paragraph(fmt::format(
      "A run of 300 steps (with a rising load: 300 after it) is compared with the reference over "
      "its last 32. It holds if it is within {} of the peak; the reference is a closed form, or "
      "the modes of the linear motion. It diverged if a value is not finite or beyond 1000 times "
      "its scale, or if its distance from the reference still grows; with masses that is called "
      "growing energy.",
      percent(kHoldsWithin)));
  document.table(problems_table(study));
  document.table(maps_table(study));
  for (const Figure& figure : figures) document.picture({figure.id, figure_title(figure), ""});
}

/// @param figures of stability_figures
Document stability_document(const StabilityStudy& study, const std::vector<Figure>& figures) {
  Document document;
  document.title = "Where the step rules fail";
  document.subtitle =
      "Maps of the step against what the problem is made of, limits against theory, "
      "limiting cases, servo rates";
  document.heading(2, "Summary");
  std::vector<Cell> items;
  for (const std::string& s : stability_sentences(study)) items.push_back({s});
  document.bullets(std::move(items));
  if (!study.limits.empty()) {
    document.heading(2, "Limits");
    document.paragraph(study_organ_words());
    document.table(
        limits_table().page("Limits found by bisection to 1 % and those of theory.", study.limits));
  }
  if (!study.servo.empty()) {
    document.heading(2, "At servo rate");
    document.paragraph(
        fmt::format("The paper's eta1 = 5 Pa s (tau = 0.208 ms), 4 mm at 90 mm/s and "
                    "held, as a servo samples it at its ticks. {}",
                    kShortWords));
  }
  for (const std::string& problem : each_once(study.servo, &ServoRow::problem)) {
    document.table(servo_table(study, problem));
  }
  if (!study.limiting_cases.empty()) {
    document.heading(2, "Limiting cases");
    document.table(expectations_table(study));
    document.table(limiting_cases_table(study));
  }
  if (!study.maps.empty()) add_maps(document, study, figures);
  typeset(document);
  return document;
}

/// One line per run of a map. SI units in the column names.
std::string stability_map_csv(const StabilityStudy& study, const std::string& id) {
  std::string text;
  for (const StabilityMap& map : study.maps) {
    if (map.id != id) continue;
    if (text.empty()) {
      text = csv_line({"rule", map.unit.empty() ? map.id : map.id + " [" + map.unit + "]", "step_s",
                       "class", "error_of_peak"});
    }
    for (const StabilityPoint& p : map.points) {
      text +=
          csv_line({step_rule_name(map.rule), significant(p.x, 6), significant(p.step_s, 6),
                    std::string(stability_class_name(p.verdict.found)), number(p.verdict.error)});
    }
  }
  return text;
}

}  // namespace

std::vector<std::string> stability_sentences(const StabilityStudy& study) {
  std::vector<std::string> sentences;
  double furthest = 0.0;
  bool all = true;
  for (const StabilityLimit& l : study.limits) {
    all = all && std::isfinite(l.found_s);
    if (std::isfinite(l.found_s)) furthest = std::max(furthest, std::abs(l.ratio() - 1.0));
  }
  if (!study.limits.empty()) {
    sentences.push_back(fmt::format("{} limits bisected{}: at most {} from theory.",
                                    study.limits.size(), all ? "" : ", not all found",
                                    percent(furthest)));
  }
  for (const StabilityLimit& l : study.limits) {
    if (!l.at_papers_eta1) continue;
    sentences.push_back(fmt::format("At the paper's eta1 {} holds above {} Hz (theory {} Hz).",
                                    step_rule_name(l.rule), significant(1.0 / l.found_s, 4),
                                    significant(1.0 / l.theory_s, 4)));
  }
  for (const ServoRow& row : study.servo) {
    if (row.rate_Hz != 1000.0) continue;
    const auto words = [](const ServoCell& cell) {
      return fmt::format("{} {}", step_rule_name(cell.rule), verdict_words(cell.verdict));
    };
    sentences.push_back(
        fmt::format("{} at 1 kHz, paper's eta1: {}.", row.problem, listed(row.cells, words, "; ")));
  }
  std::size_t wrong = 0, cells = 0;
  for (const LimitingCase& limiting_case : study.limiting_cases) {
    for (const LimitingCell& cell : limiting_case.cells) {
      ++cells;
      wrong += cell.right ? 0 : 1;
    }
  }
  if (!study.limiting_cases.empty()) {
    sentences.push_back(
        fmt::format("{} limiting cases, {} runs: {} came out otherwise than expected.",
                    study.limiting_cases.size(), cells, wrong));
  }
  if (sentences.empty()) {  // maps alone
    std::size_t runs = 0;
    for (const StabilityMap& map : study.maps) runs += map.points.size();
    sentences.push_back(fmt::format("{} maps, {} runs.", study.maps.size(), runs));
  }
  return sentences;
}

Json to_json(const StabilityStudy& study) {
  Json json;
  json["summary"] = stability_sentences(study);
  json["networks"] = study_organ_words();
  if (!study.limits.empty()) json["limits"] = limits_table().list(study.limits);
  for (const ServoRow& row : study.servo) {
    Json rate = kServoRows.object(row);
    rate["rules"] = kServoCells.list(row.cells);
    json["servo"].push_back(std::move(rate));
  }
  for (const LimitingCase& limiting_case : study.limiting_cases) {
    json["limiting_cases"].push_back({{"case", limiting_case.name},
                                      {"setup", limiting_case.setup},
                                      {"expected", limiting_case.expected},
                                      {"rules", kLimitingCells.list(limiting_case.cells)}});
  }
  for (const StabilityMap& map : study.maps) {
    std::map<std::string, int> counts;
    for (const StabilityPoint& p : map.points) {
      ++counts[std::string(stability_class_name(p.verdict.found))];
    }
    json["maps"].push_back(Json{{"map", map.id},
                                {"quantity", map.quantity},
                                {"unit", map.unit},
                                {"problem", map.problem},
                                {"rule", step_rule_name(map.rule)},
                                {"runs", counts}});
  }
  return json;
}

void write_stability(const StabilityStudy& study, const std::filesystem::path& folder,
                     const std::string& python, double seconds) {
  const std::vector<Figure> figures = stability_figures(study);
  write_report(folder, stability_document(study, figures), figures, python, {{"runs", seconds}});
  write_file(folder / "stability.json", to_text(to_json(study)));
  if (!study.limits.empty()) write_file(folder / "limits.csv", limits_table().csv(study.limits));
  if (!study.limiting_cases.empty())
    write_file(folder / "limiting_cases.csv", nested_csv(kLimitingCases, study.limiting_cases,
                                                         &LimitingCase::cells, kLimitingCells));
  if (!study.servo.empty())
    write_file(folder / "servo.csv",
               nested_csv(kServoRows, study.servo, &ServoRow::cells, kServoCells));
  for (const std::string& id : map_ids(study)) {
    write_file(folder / fmt::format("map_{}.csv", id), stability_map_csv(study, id));
  }
}

}  // namespace tpm::accuracy
