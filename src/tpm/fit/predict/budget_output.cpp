// Declared in tpm/fit/predict/error_budget.hpp.
// Output of a budget: JSON, terminal, CSV.
#include <fmt/format.h>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/plan/perception.hpp"

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

}  // namespace

Json to_json(const ErrorBudget& b) {
  const auto stored = [](double value) { return rounded(value); };
  Json stages = Json::array(), lines = Json::array();
  for (const BudgetStage& stage : b.stages) {
    const Json force = array_json(stage.force_N, stored);
    stages.push_back({{"name", stage.name}, {"summary", stage.summary}, {"force_N", force}});
  }
  for (const BudgetLine& line : b.lines) {
    lines.push_back({{"name", line.name},
                     {"kind", budget_kind_name(line.kind)},
                     {"from", line.from},
                     {"to", line.to},
                     {"largest", stored(line.largest)},
                     {"largest_at_s", stored(line.largest_at_s)},
                     {"rms", stored(line.rms)},
                     {"compared", line.largest >= kLeastLine}});
  }
  Json json{{"title", b.title},
            {"peak_N", stored(b.peak_N)},
            {"lines", lines},
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
  json["stages"] = stages;
  return json;
}

std::string to_terminal_text(const ErrorBudget& b) {
  std::string text = fmt::format("{}, peak {}; in % of it\n\n{:<16} {:<12} {:<24} {:>9} {:>9}\n",
                                 b.title, sized_text(Dimension::force, b.peak_N, 4), "line", "kind",
                                 "from -> to", "largest", "rms");
  for (const BudgetLine& line : b.lines) {
    text +=
        fmt::format("{:<16} {:<12} {:<24} {:>9} {:>9}{}\n", line.name, budget_kind_name(line.kind),
                    fmt::format("{} -> {}", line.from, line.to), in_percent(line.largest),
                    in_percent(line.rms), line.largest < kLeastLine ? "  (below 0.1 %)" : "");
  }
  text += fmt::format("{:<54} {:>9}\n", "largest sum of all lines", in_percent(b.total));
  if (b.random) {
    text += fmt::format("{:<54} {:>9}\n",
                        fmt::format("parameters, {} % band from {} drawn laws",
                                    significant(100.0 * b.random->level, 3), b.random->samples),
                        in_percent(b.random->largest));
  }
  if (b.instrument) {
    text += fmt::format("{:<54} {:>9}\n",
                        fmt::format("instrument {}, {} %", b.instrument->id,
                                    significant(100.0 * b.instrument->level, 3)),
                        in_percent(b.instrument->largest));
  }
  text += fmt::format("{:<54} {:>9}\n\n", b.instrument ? "all in quadrature" : "both in quadrature",
                      in_percent(b.combined));
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

std::string to_csv(const ErrorBudget& b) {
  std::string text = "time_s";
  for (const BudgetStage& stage : b.stages) text += fmt::format(",{}_N", stage.name);
  for (const BudgetLine& line : b.lines) text += fmt::format(",line_{}_N", line.name);
  text += "\n";
  constexpr int kDigits = 12;
  for (std::size_t i = 0; i < b.time_s.size(); ++i) {
    text += significant(b.time_s[i], kDigits);
    for (const BudgetStage& stage : b.stages) {
      text += fmt::format(",{}", significant(stage.force_N[i], kDigits));
    }
    for (const BudgetLine& line : b.lines) {
      text += fmt::format(",{}", significant(line.difference_N[i], kDigits));
    }
    text += "\n";
  }
  return text;
}

}  // namespace tpm::fit
