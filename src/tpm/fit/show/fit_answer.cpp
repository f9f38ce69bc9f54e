#include "tpm/fit/show/fit_answer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

std::string answer_row(const std::string& name, const std::string& estimate,
                       const std::string& interval, const std::string& unit,
                       const std::string& verdict) {
  return fmt::format("{:<12} {:>11}  {:<24} {:<8} {}", name, estimate, interval, unit, verdict);
}

std::string answer_head(double level) {
  return answer_row("parameter", "estimate", fmt::format("{:.4g} % interval", 100.0 * level),
                    "unit", "verdict");
}

std::string parameter_row(const ParameterResult& p) {
  const double size = size_of(p);
  const Unit unit = sized_unit(p.parameter.unit, size);
  const std::string interval =
      p.verdict == Verdict::not_profiled
          ? "-"
          : fmt::format("{} .. {}", limit_text(p, false, unit), limit_text(p, true, unit));
  return answer_row(p.parameter.name, estimate_text(p.estimate, size, unit), interval, unit.symbol,
                    verdict_text(p));
}

/// The material's parameters before those of the recording.
std::vector<const ParameterResult*> material_first(const FitResult& fit) {
  std::vector<const ParameterResult*> sorted;
  for (const bool nuisance : {false, true}) {
    for (const ParameterResult& p : fit.parameters) {
      if (p.nuisance == nuisance) sorted.push_back(&p);
    }
  }
  return sorted;
}

/// "... k5, k6: identified; tau6: flat": no verdict is left out.
std::string further_verdicts(const std::vector<std::pair<std::string, std::string>>& named,
                             std::size_t from) {
  std::vector<std::pair<std::string, std::string>> groups;  // verdict, names
  for (std::size_t i = from; i < named.size(); ++i) {
    const auto& [name, verdict] = named[i];
    const auto group = std::ranges::find(groups, verdict, [](const auto& g) { return g.first; });
    if (group == groups.end()) {
      groups.emplace_back(verdict, name);
    } else {
      group->second += ", " + name;
    }
  }
  std::string text;
  for (const auto& [verdict, names] : groups) {
    text += fmt::format("{}{}: {}", text.empty() ? "... " : "; ", names, verdict);
  }
  return text;
}

/// "liver.csv: 500 of 600 samples fitted, rms residual 1.2 mN (0.4 % of the peak)"
std::string recording_words(const FitResult& fit, const RecordingFit& r) {
  std::string text =
      fmt::format("{}: {} of {} samples fitted, rms residual {}", fit.config.data[r.choice].dataset,
                  std::count(r.fitted.begin(), r.fitted.end(), true), r.time_s.size(),
                  sized_text(quantity_dimension(r.response_quantity), r.rms_residual, 3));
  if (r.peak > 0.0) {
    text += fmt::format(" ({} % of the peak)", significant(100.0 * r.rms_residual / r.peak, 3));
  }
  if (const auto censored = std::ranges::count(r.censored, true); censored > 0) {
    text += fmt::format(", {} censored", censored);
  }
  if (const auto left_out = std::ranges::count(r.outlier, true); left_out > 0) {
    text += fmt::format(", {} outlier{} left out", left_out, left_out == 1 ? "" : "s");
  }
  if (r.not_predicted > 0) text += fmt::format(", {} not predicted", r.not_predicted);
  return text;
}

/// "linear-2, which the data prefer: k_inf = 99.9 N/m (99.5 .. 100.4; identified), ..."
std::string preferred_words(const Candidate& preferred) {
  std::string text;
  for (const ParameterResult& p : preferred.fit.parameters) {
    if (p.nuisance) continue;
    const double size = size_of(p);
    const Unit unit = sized_unit(p.parameter.unit, size);
    const std::string interval =
        p.verdict == Verdict::not_profiled
            ? ""
            : fmt::format("{} .. {}; ", limit_text(p, false, unit), limit_text(p, true, unit));
    text += fmt::format("{}{} = {} ({}{})", text.empty() ? "" : ", ", p.parameter.name,
                        with_unit(estimate_text(p.estimate, size, unit), unit), interval,
                        verdict_text(p));
  }
  const LawSpec& law = preferred.fit.config.law.value();
  if (depends_on_reference(law)) text += "; " + reference_words(law);
  return fmt::format("{}, which the data prefer: {}", law_name(law), text);
}

std::string starts_words(const FitResult& fit) {
  const std::size_t looked_at = starts_looked_at(fit);
  const bool ranked = looked_at > static_cast<std::size_t>(std::max(fit.starts_run, 0));
  return fmt::format("{}{} of {} followed starts end at this minimum",
                     ranked ? fmt::format("{} starts looked at, ", looked_at) : "",
                     fit.starts_agreeing, fit.starts_run);
}

bool contains(const std::vector<std::string>& lines, const std::string& words) {
  return std::ranges::any_of(
      lines, [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

/// Recordings that were not fitted, as warnings, and those whose law is in doubt.
void add_recordings(ShortAnswer& answer, const SpecimenStudy& study) {
  std::size_t fitted = 0;
  std::map<std::string, std::vector<std::string>> doubts;  // recordings by what is said of them
  for (const SpecimenRow& row : study.rows) {
    if (!row.fit) {
      answer.warnings.push_back(fmt::format("{} is not fitted: {}", row.name, row.reason));
      continue;
    }
    ++fitted;
    if (!row.fit->adequacy || row.fit->adequacy->is_adequate()) continue;
    const LawAdequacy& adequacy = *row.fit->adequacy;
    doubts[adequacy.is_rejected()
               ? "the law does not describe them: what is pooled supposes that it did"
           : adequacy.summary.find("too few samples") != std::string::npos
               ? "adequacy cannot be judged: too few samples at rest before the load"
               : adequacy.summary]
        .push_back(row.name);
  }
  for (const auto& [words, names] : doubts) {
    answer.conclusion.push_back(fmt::format("{} of {} recordings: {} ({})", names.size(), fitted,
                                            words, fmt::join(names, ", ")));
  }
}

}  // namespace

std::size_t starts_looked_at(const FitResult& fit) {
  const auto run = static_cast<std::size_t>(std::max(fit.starts_run, 0));
  return std::max(run, fit.config.starts);
}

ShortAnswer short_answer(const FitResult& fit) {
  constexpr std::size_t kMostLines = 4;
  ShortAnswer answer;
  answer.conclusion.push_back(fit.config.title);
  if (fit.adequacy) answer.conclusion.push_back(fit.adequacy->summary);
  std::vector<std::string> hypotheses;
  for (const HypothesisResult& h : fit.hypotheses) hypotheses.push_back("- " + h.summary);
  for (std::string& words : counted(std::move(hypotheses), kMostLines, "hypotheses")) {
    answer.conclusion.push_back(std::move(words));
  }
  answer.head = {answer_head(fit.config.level)};
  std::vector<std::pair<std::string, std::string>> verdicts;
  for (const ParameterResult* p : material_first(fit)) {
    answer.rows.push_back(parameter_row(*p));
    verdicts.emplace_back(p->parameter.name, verdict_text(*p));
  }
  answer.rest = [verdicts](std::size_t from) { return further_verdicts(verdicts, from); };
  if (fit.config.law && depends_on_reference(*fit.config.law)) {
    answer.limits.push_back(reference_words(*fit.config.law));
  }
  std::vector<std::string> recordings;
  for (const RecordingFit& r : fit.recordings) recordings.push_back(recording_words(fit, r));
  for (std::string& words : counted(std::move(recordings), kMostLines, "recordings")) {
    answer.limits.push_back(std::move(words));
  }
  std::string search = starts_words(fit);
  if (fit.recordings.empty()) {
    const std::string p =
        fit.chi_square_p ? fmt::format(", p = {}", significant(*fit.chi_square_p, 2)) : "";
    search = fmt::format("chi-square {} from {} values{}; {}", significant(fit.chi_square, 4),
                         fit.value_count, p, search);
  }
  answer.limits.push_back(std::move(search));
  if (fit.bootstrap) answer.limits.push_back(fit.bootstrap->summary);
  if (!fit.weakest_words.empty()) answer.limits.push_back("limit: " + fit.weakest_words);
  answer.warnings = remark_texts(fit.remarks);
  return answer;
}

ShortAnswer short_answer(const Selection& s) {
  const FitResult& fit = s.candidates[s.recommended].fit;
  ShortAnswer answer = short_answer(fit);
  answer.conclusion = s.summary;
  if (fit.adequacy && !contains(s.summary, fit.adequacy->summary)) {
    answer.conclusion.insert(answer.conclusion.begin(), fit.adequacy->summary);
  }
  if (s.preferred) answer.conclusion.push_back(preferred_words(s.candidates[*s.preferred]));
  answer.warnings = remark_texts(s.remarks);
  for (const Remark& remark : fit.remarks) answer.warnings.push_back(remark.text);
  return answer;
}

ShortAnswer short_answer(const SpecimenStudy& study) {
  ShortAnswer answer;
  answer.conclusion = {study.why};
  if (depends_on_reference(study.law)) answer.conclusion.push_back(reference_words(study.law));
  add_recordings(answer, study);
  answer.head = {answer_row("typical", "value",
                            fmt::format("{:.4g} % interval", 100.0 * study.level), "unit",
                            "a new specimen; recordings left out")};
  std::vector<std::pair<std::string, std::string>> names;
  for (const PooledParameter& p : study.pooled) {
    const auto natural = [&](double theta) { return p.parameter.natural(theta); };
    const Unit unit = sized_unit(p.parameter.unit, natural(p.effects.mean));
    const auto shown = [&](double theta) { return significant(natural(theta) / unit.to_si, 4); };
    std::string more = "-";
    if (p.effects.new_specimen) {
      more = fmt::format("{} .. {}", shown(p.effects.new_specimen->lower),
                         shown(p.effects.new_specimen->upper));
    }
    if (p.left_out > 0) more += fmt::format("; {} left out", p.left_out);
    if (!p.identified()) more += "; " + pooled_doubt(p.only_without, p.not_described);
    names.emplace_back(p.parameter.name, more);
    answer.rows.push_back(answer_row(
        p.parameter.name, shown(p.effects.mean),
        fmt::format("{} .. {}", shown(p.effects.interval.lower), shown(p.effects.interval.upper)),
        unit.symbol, more));
  }
  answer.rest = [names](std::size_t from) { return further_verdicts(names, from); };
  return answer;
}

ShortAnswer short_answer(const GroupComparison& c) {
  ShortAnswer answer;
  answer.conclusion = {conclusion(c), c.study.why};
  if (depends_on_reference(c.study.law)) {
    answer.conclusion.push_back(reference_words(c.study.law));
  }
  add_recordings(answer, c.study);
  const auto row = [](const std::string& name, const std::string& first, const std::string& second,
                      const std::string& difference, const std::string& p) {
    return fmt::format("{:<16} {:>11} {:>11}  {:<30} {}", name, first, second, difference, p);
  };
  answer.head = {row("typical", c.names[0], c.names[1],
                     fmt::format("second against first, {:.4g} %", 100.0 * c.study.level),
                     "p (Holm)")};
  std::vector<std::pair<std::string, std::string>> verdicts;
  const auto add = [&](const ComparedQuantity& q, bool tested) {
    const bool ratio = q.parameter.scale == Scale::log;
    const auto typical = [&](std::size_t group) {
      if (!q.typical[group]) return std::string("-");
      const double si = q.parameter.natural(q.typical[group]->mean);
      const Unit unit = sized_unit(q.parameter.unit, si);
      return fmt::format("{} {}", significant(si / unit.to_si, 4), unit.symbol);
    };
    std::string difference = q.reason, p, verdict = q.reason;
    if (q.difference) {
      const GroupDifference& d = *q.difference;
      const Unit unit = sized_unit(q.parameter.unit, d.difference);
      const auto shown = [&](double theta) {
        return significant(ratio ? std::exp(theta) : theta / unit.to_si, 4);
      };
      difference = fmt::format("{} {} ({} .. {}){}", ratio ? "x" : "+", shown(d.difference),
                               shown(d.interval.lower), shown(d.interval.upper),
                               ratio ? "" : " " + unit.symbol);
      p = tested ? significant(q.p_holm, 2) : std::string("as its parts");
      verdict = tested ? fmt::format("p (Holm) {}", p) : p;
    }
    if (const int left_out = q.left_out[0] + q.left_out[1]; left_out > 0) {
      p += fmt::format("; left out: {}", left_out);
    }
    if (const std::string doubt = doubt_of(q); !doubt.empty()) {
      p += "; " + doubt;
      verdict += "; " + doubt;
    }
    answer.rows.push_back(row(q.parameter.name, typical(0), typical(1), difference, p));
    verdicts.emplace_back(q.parameter.name, verdict);
  };
  for (const ComparedQuantity& q : c.parameters) add(q, true);
  for (const ComparedQuantity& q : c.moduli) add(q, false);
  answer.rest = [verdicts](std::size_t from) { return further_verdicts(verdicts, from); };
  answer.limits.push_back(
      fmt::format("{} and {} recordings; a typical specimen and its ratio (x) or difference (+) by "
                  "random effects",
                  c.first, c.study.rows.size() - c.first));
  return answer;
}

void add_moduli(ShortAnswer& answer, const YoungModuli& moduli) {
  std::vector<std::string> rows;
  for (const YoungModulus& m : moduli.moduli) {
    // "Pa s" of a viscosity: the prefix goes before the first unit.
    constexpr double kKilo = 1e3;
    const bool plain = m.unit == "Pa";
    const Unit unit = plain ? sized_unit(shown_unit(Dimension::stress), m.estimate)
                            : Unit{"k" + m.unit, Dimension::dimensionless, kKilo};
    const auto limit = [&](const std::optional<double>& value) {
      return value ? significant(*value / unit.to_si, kIntervalDigits) : std::string("open");
    };
    rows.push_back(
        answer_row(m.name, significant(m.estimate / unit.to_si, kEstimateDigits),
                   fmt::format("{} .. {}", limit(m.lower), limit(m.upper)), unit.symbol,
                   m.verdict.empty() ? "of " + m.of : fmt::format("of {}; {}", m.of, m.verdict)));
  }
  answer.rest = [rest = answer.rest, rows](std::size_t from) {
    if (from >= rows.size()) return rest(from - rows.size());
    return fmt::format("... {} more moduli; {}", rows.size() - from, rest(0));
  };
  answer.rows.insert(answer.rows.begin(), rows.begin(), rows.end());
  answer.limits.push_back(fmt::format("Young's moduli under {}; Poisson's ratio {} ({})",
                                      moduli.geometry, shortest(moduli.poisson_ratio),
                                      moduli.poisson_assumed ? "assumed" : "given"));
  for (const Remark& remark : moduli.remarks) answer.warnings.push_back(remark.text);
}

}  // namespace tpm::fit
