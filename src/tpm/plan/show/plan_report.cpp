#include "tpm/plan/show/plan_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/show/result_table.hpp"
#include "tpmkit/version.hpp"

namespace tpm::plan {
namespace {

constexpr double kMostMargin = 1000.0;

std::string share_text(double share) {
  constexpr double kMostShare = 10.0;  // beyond, the figure says nothing
  if (share > kMostShare) return fmt::format("over {} %", shortest(100.0 * kMostShare));
  return significant(100.0 * share, 3) + " %";
}

std::string time_text(double seconds) {
  if (seconds < 1e-6) return significant(1e9 * seconds, 3) + " ns";
  if (seconds < 1e-3) return significant(1e6 * seconds, 3) + " us";
  if (seconds < 1.0) return significant(1e3 * seconds, 3) + " ms";
  return significant(seconds, 3) + " s";
}

ResultTable<PlannedCandidate> frontier(const Plan& plan) {
  using Row = PlannedCandidate;
  using Of = ResultColumn<Row>;
  constexpr int kWidth = 10;
  const auto error = [&plan](std::optional<double> Row::*of) {
    return [&plan, of](const Row& c) { return shown_error(plan, c.*of); };
  };
  // Empty where nothing is to be said against the candidate.
  const auto against = [&plan](const Row& c) -> std::string {
    if (!c.feasible) return c.reason;
    return plan.masses_left_out ? "meets both but for masses" : "";
  };
  const auto why = [against](const Row& c) {
    const std::string words = against(c);
    return Cell{words.empty() ? "meets both" : words};
  };
  const auto reason = [against](const Row& c) {
    const std::string words = against(c);
    return words.empty() ? Json(nullptr) : Json(words);
  };
  return {
      {Of("name", &Row::name).shown("candidate", -26),
       {"formulation", &Row::formulation},
       {"settings", &Row::settings},
       {"reach", [](const Row& c) { return c.reach == ModelReach::full ? "full" : "reduced"; }},
       Of("cost_s_per_s", &Row::cost_s_per_s).shown("per s", kWidth).as(time_text),
       Of("period_s", &Row::period_s).shown("a period", kWidth).as(time_text),
       Of("claimed_error", error(&Row::claimed_error)).shown("claimed", kWidth).as(share_text),
       Of("verified_error", error(&Row::verified_error)).shown("verified", kWidth).as(share_text),
       {"verified_response_error", error(&Row::verified_response_error)},
       {"accurate", &Row::accurate},
       {"feasible", &Row::feasible},
       Of("reason", reason).shown("").in_words(why)}};
}

const ResultTable<TriedSpheres>& tried_spheres() {
  using Row = TriedSpheres;
  using Of = ResultColumn<Row>;
  const auto run = [](const Row& t) { return Cell{t.peak ? time_text(t.operations_s) : "-"}; };
  const auto reason = [](const Row& t) { return Cell{t.reason}; };
  const auto reason_or_null = [](const Row& t) {
    return t.reason.empty() ? Json(nullptr) : Json(t.reason);
  };
  static const ResultTable<Row> table(
      {Of("spheres", [](const Row& t) { return t.filling.spheres; }).shown("spheres", 9),
       Of("spacing_m", &Row::spacing_m).shown("spacing, mm", 11, 1e-3, 3),
       Of("area_ratio", &Row::area_ratio).shown("area", 10, 1.0, 3),
       Of("peak", &Row::peak).shown("peak", 12, 1.0, 5),
       Of("claimed_error", &Row::claimed_error).shown("claimed", 10).as(share_text),
       Of("run_s", &Row::operations_s).shown("a run", 10).in_words(run),
       Of("reason", reason_or_null).shown("").in_words(reason)});
  return table;
}

Json relevance_json(const Plan& plan) {
  return array_json(plan.relevance, [](const PlanRelevance& r) {
    return Json{{"part", r.part},
                {"error", or_null(r.error)},
                {"estimated", r.estimated},
                {"matters", r.matters},
                {"note", r.note}};
  });
}

std::string change_text(const PlanChange& c) {
  constexpr double kApart = 1.1;  // above, the search ended before the two factors met
  if (!c.factor && c.survived < kMostChange) {
    return fmt::format(
        "  {}: {}, and the plan may not take longer (--thorough)\n", c.change,
        c.survived > 1.0 ? fmt::format("nothing breaks up to {} times", significant(c.survived, 3))
                         : std::string("not tried"));
  }
  if (!c.factor) {
    return fmt::format("  {} times {}: nothing breaks\n", shortest(kMostChange), c.change);
  }
  const std::string factor = significant(*c.factor, 3);
  if (*c.factor / c.survived <= kApart) {
    return fmt::format("  {} times {}: {}\n", factor, c.change, c.breaks);
  }
  return fmt::format("  {} to {} times {}: {}\n", significant(c.survived, 3), factor, c.change,
                     c.breaks);
}

Json changes_json(const Plan& plan) {
  return array_json(plan.changes, [](const PlanChange& c) {
    return Json{{"change", c.change},
                {"factor", or_null(c.factor)},
                {"survived", rounded(c.survived)},
                {"breaks", c.factor ? Json(c.breaks) : Json(nullptr)}};
  });
}

std::string budget_text(const PlanBudget& budget) {
  std::string text;
  if (budget.rate_Hz) text += fmt::format("a servo of {} Hz", shortest(*budget.rate_Hz));
  if (budget.wall_s_per_s) {
    text += fmt::format("{}{} s per s", text.empty() ? "" : ", ", shortest(*budget.wall_s_per_s));
  }
  return text.empty() ? "no budget" : text;
}

std::string relevance_text(const PlanRelevance& r) {
  const std::string note = r.note.empty() ? "" : fmt::format(" ({})", r.note);
  if (!r.error) return fmt::format("  {}: {}\n", r.part, r.note);
  return fmt::format("  {}: {}, {} of the peak{}\n", r.part,
                     r.matters ? "matters" : "does not matter", share_text(*r.error), note);
}

/// Source of the number masses_left_out.
std::string masses_note(const Plan& plan) {
  std::string note = "by the linear network";
  for (const PlanRelevance& r : plan.relevance) {
    if (r.part == "inertia") note = r.note;
  }
  return note.empty() ? note : fmt::format(" ({})", note);
}

/// Without a servo or a budget of time the network itself can run: the cheapest candidate with the
/// whole network that meets the tolerance, and its time, s.
std::optional<std::pair<std::string, double>> run_offline(const Plan& plan) {
  if (plan.request.budget.rate_Hz || plan.request.budget.wall_s_per_s) return std::nullopt;
  const auto runs = [](const PlannedCandidate& c) {
    return c.accurate && c.reach == ModelReach::full && c.cost_s_per_s;
  };
  const auto found = std::find_if(plan.candidates.begin(), plan.candidates.end(), runs);
  if (found == plan.candidates.end()) return std::nullopt;
  return std::pair{found->name, *found->cost_s_per_s * plan.duration_s};
}

/// Ratio of the tolerance to the verified error of the pick, limited: beyond, the error is
/// rounding.
double margin(const Plan& plan) {
  return std::min(
      plan.request.tolerance / std::max(shown_error(plan, *plan.chosen().verified_error), 1e-300),
      kMostMargin);
}

std::string margin_text(const Plan& plan) {
  const double times = margin(plan);
  return times < kMostMargin ? significant(times, 3) + " times"
                             : fmt::format("over {} times", shortest(kMostMargin));
}

std::string pick_text(const Plan& plan) {
  const PlannedCandidate& c = plan.chosen();
  std::string text = fmt::format(
      "pick: {} ({}{}{})\n  claimed error at most {}, verified {}; margin {}\n  costs {} "
      "per "
      "simulated second{}\n",
      c.name, c.formulation, c.settings.empty() ? "" : ", ", c.settings,
      share_text(shown_error(plan, *c.claimed_error)),
      share_text(shown_error(plan, *c.verified_error)), margin_text(plan),
      time_text(*c.cost_s_per_s),
      c.period_s ? fmt::format(", {} a period", time_text(*c.period_s)) : std::string());
  const std::string offline = offline_text(plan);
  if (!offline.empty()) text += "  " + offline;
  if (c.verified_response_error) {
    text += fmt::format("  nothing is claimed of the {}: verified error {}\n",
                        plan.by_depth ? "contact force" : "indentation depth",
                        share_text(shown_error(plan, *c.verified_response_error)));
  }
  return text;
}

std::string choice_text(const Plan& plan) {
  std::string text = plan.choice ? pick_text(plan) : "no model meets tolerance and budget\n";
  if (!plan.choice && plan.without_budget) {
    const PlannedCandidate& c = plan.candidates[*plan.without_budget];
    text += fmt::format("  without the budget: {}, {} per simulated second, verified error {}\n",
                        c.name, time_text(*c.cost_s_per_s),
                        share_text(shown_error(plan, *c.verified_error)));
  }
  if (plan.needs_full) {
    text += "  the scene needs the full nonlinear model: no reduced one meets the tolerance\n";
  }
  return text;
}

/// The planned scene and the request.
std::string subject_text(const Plan& plan) {
  const PlanRequest& request = plan.request;
  std::string text = fmt::format("{}: {} spheres, {} bonds, {} s\n", plan.title, plan.spheres,
                                 plan.bonds, significant(plan.duration_s, 4));
  text += fmt::format(
      "{} within {} of the peak{}, {}; costs of operations: {}\n", claim_of(plan).quantity,
      share_text(request.tolerance),
      request.tolerance_source.empty() ? std::string()
                                       : fmt::format(" ({})", request.tolerance_source),
      budget_text(request.budget),
      request.costs.source == "nominal" ? "nominal (tpm plan --calibrate measures this machine)"
                                        : request.costs.source);
  return text;
}

/// The lines of a text, without blanks before them.
std::vector<std::string> text_lines(const std::string& text) {
  std::vector<std::string> lines = separate_lines(text);
  for (std::string& line : lines) line.erase(0, line.find_first_not_of(' '));
  return lines;
}

/// Relevant and irrelevant effects, each in one line.
std::vector<std::string> relevance_lines(const Plan& plan) {
  std::string matters, not_found, rest;
  const auto add = [](std::string& to, const std::string& words) {
    to += to.empty() ? words : ", " + words;
  };
  for (const PlanRelevance& r : plan.relevance) {
    // Of masses that scene and reference leave out there is a warning.
    if (r.part == "inertia" && !plan.inertial && r.error && r.matters) continue;
    if (!r.error) {
      add(not_found, fmt::format("{} ({})", r.part, r.note));
    } else {
      add(r.matters ? matters : rest, fmt::format("{} {}", r.part, share_text(*r.error)));
    }
  }
  std::vector<std::string> lines;
  if (!matters.empty()) lines.push_back("matters, in parts of the peak: " + matters);
  if (!rest.empty()) lines.push_back("does not matter: " + rest);
  if (!not_found.empty()) lines.push_back("not known whether it matters: " + not_found);
  return lines;
}

/// The candidates that were run, the pick first.
std::vector<const PlannedCandidate*> run_candidates(const Plan& plan) {
  std::vector<const PlannedCandidate*> run;
  if (plan.choice) run.push_back(&plan.chosen());
  for (const PlannedCandidate& c : plan.candidates) {
    if (c.verified_error && (run.empty() || &c != run.front())) run.push_back(&c);
  }
  return run;
}

/// Effect of masses, where no error that is shown counts it.
std::optional<double> masses_uncounted(const Plan& plan) {
  if (plan.inertial || plan.masses_left_out) return std::nullopt;
  for (const PlanRelevance& r : plan.relevance) {
    if (r.part == "inertia") return r.error;
  }
  return std::nullopt;
}

}  // namespace

Json spheres_json(const SpheresPlan& plan) {
  return {{"tolerance", plan.request.tolerance},
          {"most", plan.request.most},
          {"spheres", plan.choice ? Json(plan.chosen().filling.spheres) : Json(nullptr)},
          {"claimed_error", plan.choice ? or_null(plan.chosen().claimed_error) : Json(nullptr)},
          {"limit_peak", rounded(plan.limit_peak)},
          {"limit_uncertainty", rounded(plan.limit_uncertainty)},
          {"tried", tried_spheres().list(plan.tried)}};
}

std::string spheres_words(const SpheresPlan& plan) {
  return plan.choice
             ? fmt::format(
                   "spheres: {}, at most {} of the peak from the limit of many small ones "
                   "({} allowed)",
                   plan.chosen().filling.spheres, share_text(*plan.chosen().claimed_error),
                   share_text(plan.request.tolerance))
             : fmt::format(
                   "spheres: no number up to {} is within {} of the limit of many small ones",
                   plan.request.most, share_text(plan.request.tolerance));
}

std::string spheres_text(const SpheresPlan& plan) {
  std::string text = fmt::format("{}\n\n{}", spheres_words(plan), tried_spheres().text(plan.tried));
  return text + fmt::format("{:>9} {:>11} {:>10} {:>12} {:>10}  a line in the spacing, 95 %\n\n",
                            "limit", 0, plan.tried.front().area_ratio ? "1" : "-",
                            significant(plan.limit_peak, 5), share_text(plan.limit_uncertainty));
}

std::string offline_text(const Plan& plan) {
  constexpr double kNoPlanNeeded_s = 1.0;
  const auto offline = run_offline(plan);
  if (!offline || offline->second > kNoPlanNeeded_s) return {};
  return fmt::format("one offline run needs no plan: the network itself ({}) takes {}\n",
                     offline->first, time_text(offline->second));
}

Json expected_plan_json(const ExpectedPlanWork& work) {
  return {{"first_run_s", rounded(work.first_run_s)},
          {"reference_s", rounded(work.reference_s, 2)},
          {"all_s", work.all_s ? Json(rounded(*work.all_s, 2)) : Json(nullptr)}};
}

std::string expected_plan_text(const ExpectedPlanWork& work) {
  if (!work.all_s)
    return "masses count, or all is tried: how long planning takes is known after its reference, "
           "which masses make many times as long\n";
  return fmt::format("planning takes up to some {} on a usual machine\n",
                     time_text(rounded(*work.all_s, 1)));
}

Json masses_matter_json(const Plan& plan) {
  const bool matter = plan.inertial || plan.masses_left_out.has_value();
  return matter || plan.masses_unknown.empty() ? Json(matter) : Json(nullptr);
}

Json claim_json(const Plan& plan) {
  const PlanClaim claim = claim_of(plan);
  return {{"quantity", claim.quantity}, {"norm", claim.norm}, {"protocol", claim.protocol}};
}

std::vector<Remark> plan_remarks(const Plan& plan) {
  std::vector<Remark> remarks;
  if (const auto masses = masses_uncounted(plan); masses && plan.choice) {
    const double together = *masses + plan.chosen().claimed_error.value_or(0.0);
    if (together > plan.request.tolerance) {
      remarks.push_back(
          {"masses_uncounted",
           fmt::format("no error above counts masses, which would change the answer by {} of the "
                       "peak: with the claimed error {}, which exceeds the tolerance",
                       share_text(*masses), share_text(together))});
    }
  }
  if (plan.masses_left_out) {
    remarks.push_back(
        {"masses_left_out",
         fmt::format(
             "inertia matters, and scene and reference leave it out: masses would change the "
             "answer by {} of the peak{}, which exceeds the tolerance; all errors above count "
             "that. "
             "{}",
             share_text(*plan.masses_left_out), masses_note(plan),
             plan.request.for_loop ? "Nothing that a loop steps has masses."
                                   : "For a model with masses, write \"formulation\": {\"kind\": "
                                     "\"inertial\"} in the scene.")});
  }
  if (!plan.masses_unknown.empty()) {
    remarks.push_back(
        {"masses_unknown",
         fmt::format("not known what masses would change, and no error above counts it: {}",
                     plan.masses_unknown)});
  }
  remarks.insert(remarks.end(), plan.validity.begin(), plan.validity.end());
  return remarks;
}

Json plan_json(const Plan& plan) {
  const PlanRequest& request = plan.request;
  Json json{{"title", plan.title},
            {"version", version()},
            {"spheres", plan.spheres},
            {"bonds", plan.bonds},
            {"duration_s", rounded(plan.duration_s)},
            {"tolerance", request.tolerance},
            {"tolerance_source",
             request.tolerance_source.empty() ? Json(nullptr) : Json(request.tolerance_source)},
            {"output", request.measure.output == PlanOutput::field ? "field" : "force"},
            {"rate_Hz", or_null(request.budget.rate_Hz)},
            {"wall_s_per_s", or_null(request.budget.wall_s_per_s)},
            {"costs", request.costs.source},
            {"response", plan.by_depth ? "force_N" : "depth_m"}};
  json["claim"] = claim_json(plan);
  json["choice"] = plan.choice ? frontier(plan).object(plan.chosen()) : Json(nullptr);
  json["margin"] = plan.choice ? Json(rounded(margin(plan))) : Json(nullptr);
  const auto offline = run_offline(plan);
  json["network_offline_s"] = offline ? Json(rounded(offline->second)) : Json(nullptr);
  json["without_budget"] = plan.without_budget
                               ? frontier(plan).object(plan.candidates[*plan.without_budget])
                               : Json(nullptr);
  json["needs_full_model"] = plan.needs_full;
  json["masses_matter"] = masses_matter_json(plan);
  json["masses_left_out"] = or_null(plan.masses_left_out);
  json["reference"] = {{"method", plan.reference.method},
                       {"cross_check", plan.reference.cross_check},
                       {"difference", rounded(plan.reference.difference, 2)},
                       {"peak", rounded(plan.reference.peak)}};
  json["work"] = {{"first_run_s", rounded(plan.work.first_run_s)},
                  {"reference_run_s", rounded(plan.work.reference_run_s)},
                  {"reference_s", rounded(plan.work.reference_s)},
                  {"all_s", rounded(plan.work.all_s)}};
  json["frontier"] = frontier(plan).list(plan.candidates);
  json["relevance"] = relevance_json(plan);
  json["changes"] = changes_json(plan);
  json["validity_passed"] = remarks_json(plan.validity);
  json["remarks"] = remarks_json(plan_remarks(plan));
  return json;
}

std::string plan_text(const Plan& plan) {
  std::string text = fmt::format("{}{}\n{}", subject_text(plan), choice_text(plan),
                                 frontier(plan).text(plan.candidates));
  text +=
      fmt::format("\nreference: {}; peak {} {}; differs from its cross-check ({}) by {}\n",
                  plan.reference.method,
                  significant(plan.by_depth ? plan.reference.peak : 1e3 * plan.reference.peak, 6),
                  plan.by_depth ? "N" : "mm", plan.reference.cross_check,
                  share_text(plan.reference.difference));
  text += fmt::format(
      "planning took what a usual machine does in {}; reference and cross-check {} of it\n",
      time_text(plan.work.all_s), time_text(plan.work.reference_s));
  if (!plan.relevance.empty()) text += "what leaving a part out changes:\n";
  for (const PlanRelevance& r : plan.relevance) {
    // Of masses that scene and reference leave out there is one sentence, below.
    if (r.part != "inertia" || plan.inertial || !r.matters) text += relevance_text(r);
  }
  if (!plan.changes.empty()) text += "robustness margins:\n";
  for (const PlanChange& c : plan.changes) {
    text += change_text(c);
  }
  for (const Remark& remark : plan_remarks(plan)) {
    text += fmt::format("WARNING: {}\n", remark.text);
  }
  return text;
}

ShortAnswer short_answer(const Plan& plan) {
  constexpr std::size_t kShown = 4;  // candidates
  ShortAnswer answer;
  answer.conclusion = text_lines(subject_text(plan) + choice_text(plan));
  const std::vector<const PlannedCandidate*> run = run_candidates(plan);
  answer.head = {frontier(plan).head()};
  for (const PlannedCandidate* c : run) {
    if (answer.rows.size() == kShown && run.size() > kShown + 1) break;
    answer.rows.push_back(frontier(plan).line(*c));
  }
  const std::size_t shown = answer.rows.size();
  const auto others = [count = plan.candidates.size(), run = run.size()](std::size_t from) {
    return fmt::format("... {} more candidates, {} of them were run", count - from, run - from);
  };
  if (shown < plan.candidates.size()) answer.rows.push_back(others(shown));
  answer.rest = others;
  answer.limits.push_back(fmt::format(
      "reference: {}; peak {}; differs from its cross-check by {}", plan.reference.method,
      sized_text(plan.by_depth ? Dimension::force : Dimension::length, plan.reference.peak, 6),
      share_text(plan.reference.difference)));
  for (std::string& line : relevance_lines(plan)) answer.limits.push_back(std::move(line));
  for (const PlanChange& c : plan.changes) {
    for (const std::string& line : text_lines(change_text(c))) {
      answer.limits.push_back(c.factor ? "limit: " + line : line);
    }
  }
  answer.warnings = remark_texts(plan_remarks(plan));
  return answer;
}

}  // namespace tpm::plan
