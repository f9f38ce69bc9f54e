// Declared in tpm/fit/design/design.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/design/design_words.hpp"
#include "tpm/fit/fit.hpp"

namespace tpm::fit {
namespace {

Json to_json(const PlannedExperiment& e) {
  Json j;
  if (e.kind == PlannedExperiment::Kind::creep) {
    j = {{"kind", "creep"}, {"load_N", or_null(e.load_N)}};
  } else {
    j = {{"kind", "ramp_hold"},
         {"depth_m", or_null(e.depth_m)},
         {"rate_m_per_s", or_null(e.rate_m_per_s)}};
  }
  j["hold_s"] = or_null(e.hold_s);
  j["interval_s"] = or_null(e.interval_s);
  j["repeats"] = e.repeats;
  j["total_time_s"] = or_null(e.total_s());
  return j;
}

Json to_json(const Expectation& expected, const DesignProblem& problem) {
  Json list = Json::array();
  for (std::size_t i = 0; i < expected.parameters.size(); ++i) {
    const ExpectedParameter& p = expected.parameters[i];
    list.push_back({{"name", p.name},
                    {"unit", si_symbol(problem.parameter(i).unit.dimension)},
                    {"value", or_null(p.value)},
                    {"relative_standard_error", or_null(p.relative_error)},
                    {"lower", or_null(p.lower.value_or(NAN))},
                    {"upper", or_null(p.upper.value_or(NAN))},
                    {"identified", p.identified},
                    {"rival", p.rival},
                    {"rival_correlation", or_null(p.rival_correlation)}});
  }
  return {{"score", or_null(expected.score)},
          {"effective_samples", or_null(expected.effective_samples)},
          {"parameters", std::move(list)}};
}

Json to_json(const DesignCheck& check) {
  Json list = array_json(check.parameters, [](const CheckedParameter& p) {
    return Json{{"name", p.name},
                {"predicted_theta_sd", or_null(p.predicted)},
                {"observed_theta_sd", or_null(p.observed)},
                {"ratio", or_null(p.ratio)},
                {"ratio_error", or_null(p.ratio_error)},
                {"bias_in_predicted_sd", or_null(p.bias)},
                {"bias_error", or_null(p.bias_error)},
                {"covered", p.covered},
                {"agrees", p.agrees}};
  });
  return {{"seed", check.seed},
          {"data_sets", check.sets},
          {"failed", check.failed},
          {"at_bound", check.at_bound},
          {"parameters", std::move(list)},
          {"remarks", remarks_json(check.remarks)}};
}

std::string percent(double relative) {
  if (!std::isfinite(relative)) return "unknown";
  return fmt::format("{} %", significant(100.0 * relative, 3));
}

constexpr const char* kAboveCandidates =
    "expected relative standard errors; ? marks what would not be identified";

std::string candidate_head(const DesignResult& result) {
  std::string text = fmt::format("{:>4}  {:<56}{:>10}", "", "candidate", "score");
  for (const ExpectedParameter& p : result.ranked.front().expected.parameters) {
    text += fmt::format("{:>12}", p.name);
  }
  return text;
}

std::vector<std::string> candidate_rows(const DesignResult& result, std::size_t top) {
  std::vector<std::string> rows;
  for (std::size_t i = 0; i < std::min(top, result.ranked.size()); ++i) {
    const DesignCandidate& c = result.ranked[i];
    std::string row = fmt::format("{:>3}.  {:<56}{:>10}", i + 1, experiment_words(c.experiment),
                                  percent(c.expected.score));
    for (const ExpectedParameter& p : c.expected.parameters) {
      row += fmt::format("{:>12}", percent(p.relative_error) + (p.identified ? " " : "?"));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string best_pair(const DesignResult& result) {
  const bool same = result.pair.first == result.pair.second;
  return fmt::format("best pair: {}; then {}", experiment_words(result.pair.first),
                     same ? "the same again" : experiment_words(result.pair.second));
}

std::string pair_words(const DesignResult& result) {
  std::string text = best_pair(result) + "\n";
  for (std::size_t i = 0; i < result.pair.expected.parameters.size(); ++i) {
    const ExpectedParameter& p = result.pair.expected.parameters[i];
    text += fmt::format("  {}: {}, {}\n", p.name, interval_words(result.problem.parameter(i), p),
                        p.identified ? "identified" : "not identified");
  }
  return text;
}

std::string cheapest_words(const DesignResult& result) {
  if (!result.cheapest) return "no single candidate identifies every parameter";
  const DesignCandidate& c = result.ranked[*result.cheapest];
  return fmt::format("least time that identifies every parameter: {} ({} s in all; place {})",
                     experiment_words(c.experiment), significant(c.experiment.total_s(), 4),
                     *result.cheapest + 1);
}

std::string sets_words(const DesignCheck& check) {
  return fmt::format(
      "{} simulated data sets of the best candidate, seed {}, {} could not be fitted", check.sets,
      check.seed, check.failed);
}

std::vector<std::string> check_lines(const DesignCheck& check, double level) {
  std::vector<std::string> lines;
  for (const CheckedParameter& p : check.parameters) {
    lines.push_back(fmt::format(
        "{:<12} spread / prediction {} +- {}, bias {} +- {} standard errors, {} of {} within the "
        "{:.4g} % interval",
        p.name, fixed(p.ratio, 3), fixed(p.ratio_error, 3), fixed(p.bias, 2),
        fixed(p.bias_error, 2), p.covered, check.sets, 100.0 * level));
  }
  return lines;
}

}  // namespace

Json to_json(const DesignResult& result, const DesignCheck* check, std::size_t top) {
  const DesignProblem& problem = result.problem;
  Json j{{"title", problem.config.title},
         {"criterion", criterion_words(problem)},
         {"confidence_level", problem.config.level},
         {"identified_factor", problem.factor},
         {"candidates_evaluated", result.ranked.size()},
         {"left_out", remarks_json(result.left_out)}};
  Json list = Json::array();
  for (std::size_t i = 0; i < std::min(top, result.ranked.size()); ++i) {
    const DesignCandidate& c = result.ranked[i];
    list.push_back({{"experiment", to_json(c.experiment)},
                    {"samples", or_null(c.one.samples)},
                    {"peak_depth_m", or_null(c.one.peak_depth_m)},
                    {"expected", to_json(c.expected, problem)}});
  }
  j["ranked"] = std::move(list);
  j["pair"] = {{"first", to_json(result.pair.first)},
               {"second", to_json(result.pair.second)},
               {"expected", to_json(result.pair.expected, problem)}};
  j["least_time"] = nullptr;
  if (result.cheapest) j["least_time"] = to_json(result.ranked[*result.cheapest].experiment);
  j["summary"] = result.summary;
  j["check"] = nullptr;
  if (check != nullptr) j["check"] = to_json(*check);
  return j;
}

std::string to_terminal_text(const DesignResult& result, const DesignCheck* check,
                             std::size_t top) {
  const DesignProblem& problem = result.problem;
  std::string text = fmt::format("{}\n{} candidates; best by the {}\n", problem.config.title,
                                 result.ranked.size(), criterion_words(problem));
  for (const Remark& limit : result.left_out) text += fmt::format("left out: {}\n", limit.text);
  text += fmt::format("\n{}\n{}\n", kAboveCandidates, candidate_head(result));
  for (const std::string& row : candidate_rows(result, top)) text += row + "\n";
  text += "\n";
  for (const std::string& line : result.summary) text += line + "\n";
  text += "\n" + cheapest_words(result) + "\n" + pair_words(result);
  if (check == nullptr) return text;
  text += "\n" + sets_words(*check) + "\n";
  for (const std::string& line : check_lines(*check, problem.config.level)) text += line + "\n";
  for (const Remark& remark : check->remarks) text += fmt::format("warning: {}\n", remark.text);
  return text;
}

ShortAnswer short_answer(const DesignResult& result, const DesignCheck* check, std::size_t top) {
  constexpr std::size_t kMostLeftOut = 2, kMostParameters = 5;
  const DesignProblem& problem = result.problem;
  ShortAnswer answer;
  answer.conclusion = {
      problem.config.title,
      fmt::format("best of {} candidates by the {}: {}", result.ranked.size(),
                  criterion_words(problem), experiment_words(result.ranked.front().experiment))};
  for (std::string& line : counted(remark_texts(result.left_out), kMostLeftOut, "limits")) {
    answer.conclusion.push_back("left out: " + line);
  }
  answer.head = {kAboveCandidates, candidate_head(result)};
  answer.rows = candidate_rows(result, top);
  answer.rest = [count = result.ranked.size()](std::size_t from) {
    return fmt::format("... {} more candidates", count - from);
  };
  answer.limits = counted(result.summary, kMostParameters, "parameters");
  answer.limits.push_back(cheapest_words(result));
  answer.limits.push_back(best_pair(result));
  if (check == nullptr) return answer;
  answer.limits.push_back(sets_words(*check));
  for (std::string& line :
       counted(check_lines(*check, problem.config.level), kMostParameters, "parameters")) {
    answer.limits.push_back(std::move(line));
  }
  answer.warnings = remark_texts(check->remarks);
  return answer;
}

}  // namespace tpm::fit
