#include "tpm/fit/select/gate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "tpm/base/text.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/conditional.hpp"
#include "tpm/fit/select/unloading_test.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

/// Why a law's parameters are not known.
struct Refusal {
  std::string reason;
  bool by_wald = false;  ///< by a standard error alone, or because there is none
};

const LawParameter* material_parameter(const std::vector<LawParameter>& table,
                                       const std::string& name) {
  for (const LawParameter& p : table) {
    if (p.name == name && !p.nuisance) return &p;
  }
  return nullptr;
}

/// A material may relax to nothing: without a plateau the law stays what it is (a branch without
/// its stiffness has a time that means nothing).
bool may_vanish(const LawSpec& law, const std::string& parameter) {
  return parameter == "k_inf" && (law.branches > 0 || law.fractional != Fractional::none);
}

/// See Candidate::contradicted.
bool contradicts(const Candidate& candidate, const ProtocolSpans& spans) {
  double longest_s = 0.0;
  const auto table = law_parameters(candidate.fit.config.law.value());
  for (const ParameterResult& p : candidate.fit.parameters) {
    const LawParameter* law = material_parameter(table, p.parameter.name);
    if (law == nullptr || law->dimension != Dimension::time) continue;
    if (spans.samples_too_far_for(p.estimate)) return true;
    longest_s = std::max(longest_s, p.estimate);
  }
  return !candidate.law.solid && spans.too_short_to_end(longest_s);
}

/// A branch that relaxes faster than the samples follow acts as a dashpot: its stiffness and time
/// are not told, but their product is.
std::string dashpot_words(const FitResult& fit, const std::string& time_name) {
  constexpr std::string_view kTime = "tau", kStiffness = "k";
  if (!time_name.starts_with(kTime)) return {};
  const std::string stiffness = std::string(kStiffness) + time_name.substr(kTime.size());
  const auto of = [&](const std::string& name) {
    return std::ranges::find_if(fit.parameters,
                                [&](const ParameterResult& p) { return p.parameter.name == name; });
  };
  const auto k = of(stiffness), tau = of(time_name);
  if (k == fit.parameters.end() || tau == fit.parameters.end()) return {};
  return fmt::format(": the samples tell {} {} = {} {} s alone, a dashpot", stiffness, time_name,
                     significant(k->estimate * tau->estimate, 4), si_unit(k->parameter));
}

Refusal refusal_of(const Candidate& candidate, const ProtocolSpans& spans) {
  constexpr int kLeastStandardErrors = 2;
  double longest_s = 0.0;
  Refusal first;  // of a standard error: other reasons go before it
  const auto keep = [&](Refusal refusal) {
    if (first.reason.empty()) first = std::move(refusal);
  };
  const auto table = law_parameters(candidate.fit.config.law.value());
  for (std::size_t i = 0; i < candidate.fit.parameters.size(); ++i) {
    const ParameterResult& p = candidate.fit.parameters[i];
    const bool on_bound = p.at_lower_bound || p.at_upper_bound;
    if (p.nuisance && on_bound && is_contact_under_load(candidate.fit.config, i)) {
      return {fmt::format("{} ends at its {} bound: undetermined", p.parameter.name,
                          p.at_lower_bound ? "lower" : "upper")};
    }
    const LawParameter* law = material_parameter(table, p.parameter.name);
    if (law == nullptr) continue;
    if (is_dashpot(p)) continue;
    if (p.at_lower_bound && may_vanish(candidate.law, law->name)) continue;
    if (p.at_lower_bound || p.at_upper_bound) {
      const bool fast = p.at_lower_bound && law->dimension == Dimension::time;
      return {fmt::format("{} ends at its {} bound{}", p.parameter.name,
                          p.at_lower_bound ? "lower" : "upper",
                          fast ? dashpot_words(candidate.fit, p.parameter.name) : "")};
    }
    for (const Condition& c : p.conditional_on) {
      if (!c.at_estimate) continue;
      return {fmt::format("{} ends at its {} bound, and {} depends on it", c.parameter,
                          c.upper ? "upper" : "lower", p.parameter.name)};
    }
    if (p.unconfirmed) return {fmt::format("{}: {}", p.parameter.name, p.unconfirmed->text)};
    // An interval says more than the standard error, and stands in the table of the parameters.
    const bool has_interval = p.verdict == Verdict::identified || p.verdict == Verdict::lower_only;
    if (!p.standard_error && !has_interval) {
      keep({fmt::format("{} has no standard error", p.parameter.name), true});
      continue;
    }
    const bool from_zero = p.parameter.scale == Scale::linear && p.parameter.lower == 0.0 &&
                           !may_vanish(candidate.law, law->name);
    if (from_zero && !has_interval && p.estimate < kLeastStandardErrors * *p.standard_error) {
      keep({fmt::format("{} is less than {} standard errors above 0", p.parameter.name,
                        kLeastStandardErrors),
            true});
    }
    if (law->dimension != Dimension::time) continue;
    const bool closed = p.verdict == Verdict::identified;
    if (!closed && p.standard_error && *p.standard_error > p.estimate) {
      keep({fmt::format("{} is known only to its order of magnitude", p.parameter.name), true});
    }
    if (spans.samples_too_far_for(p.estimate)) {
      return {
          fmt::format("{} is sampled by fewer than {} points", p.parameter.name, kLeastSamples)};
    }
    longest_s = std::max(longest_s, p.estimate);
  }
  if (!candidate.law.solid && spans.too_short_to_end(longest_s)) {
    return {fmt::format("a hold of {} s does not tell that nothing remains in the end",
                        significant(spans.hold_s, 3))};
  }
  return first;
}

/// Simpler law that a law equals at these parameters.
std::string special_case(const FitResult& fit) {
  std::string words;
  for (const ParameterResult& p : fit.parameters) {
    if (!is_dashpot(p)) continue;
    words += fmt::format("{}{} = 1: the spring-pot is a dashpot", words.empty() ? "" : "; ",
                         p.parameter.name);
  }
  return words;
}

/// The law that would be recommended if a standard error did not speak against it.
std::optional<std::size_t> refused_by_wald_alone(Selection& s, const std::vector<bool>& profiled) {
  for (std::size_t i = 0; i < s.candidates.size(); ++i) {
    Candidate& c = s.candidates[i];
    if (c.failed || c.identified || !c.by_wald || profiled[i]) continue;
    c.identified = true;
    const bool wins = least_within(s.candidates, s.margin) == i;
    c.identified = false;
    if (wins) return i;
  }
  return std::nullopt;
}

}  // namespace

void judge_unloading(Selection& s, std::span<const PreparedRecording> recordings,
                     const SetupOptions& setup) {
  const FitResult& closest = s.candidates.front().fit;
  const auto refute = [](Candidate& c, std::string words) {
    if (words.empty()) return;
    c.unloading_refutes = c.contradicted = true;
    c.identified = c.by_wald = false;
    c.reason = std::move(words);
  };
  for (Candidate& c : s.candidates) {
    if (!c.failed && !has_memory(c.law)) refute(c, unloading_off(c.fit, closest).words());
  }
  if (s.candidates.front().unloading_refutes) {
    for (Candidate& c : s.candidates) {
      if (c.failed || !has_memory(c.law) || c.delta_bic > kDecisiveBic) continue;
      refute(c, both_off(c.fit, closest, recordings, setup));
    }
  }
  s.recommended = least_within(s.candidates, s.margin);
}

std::string law_of_unloading(const Selection& s) {
  const Candidate& closest = s.candidates.front();
  const std::size_t samples = unloading_off(closest.fit, closest.fit).samples;
  for (const Candidate& c : s.candidates) {
    if (c.failed || c.unloading_refutes) continue;
    if (has_memory(c.law) && c.delta_bic <= kDecisiveBic) {  // judge_unloading() has tried it
      return fmt::format(
          "{} describes both if it is fitted to both, but the loading does not tell "
          "its parameters ({})",
          law_name(c.law), c.reason);
    }
    const UnloadingOff off = unloading_off(c.fit, closest.fit);
    if (off.samples < samples || off.times > 0.0) continue;
    return fmt::format("{} describes the unloading, but is behind by {} in BIC of the loading",
                       law_name(c.law), significant(c.delta_bic, 3));
  }
  return {};
}

std::string not_identified(const Candidate& candidate, const ProtocolSpans& spans) {
  return refusal_of(candidate, spans).reason;
}

void judge_identified(Candidate& candidate, const ProtocolSpans& spans) {
  Refusal refusal = refusal_of(candidate, spans);
  candidate.identified = refusal.reason.empty();
  candidate.reason = std::move(refusal.reason);
  candidate.by_wald = refusal.by_wald;
  candidate.special = special_case(candidate.fit);
  candidate.contradicted = contradicts(candidate, spans);
}

void reassess(Candidate& chosen, const ProtocolSpans& spans) {
  if (chosen.unloading_refutes) return;
  // Profiles show a minimum that is not trusted; nothing else that they show speaks against a law.
  const bool doubtful = std::ranges::any_of(
      chosen.fit.parameters, [](const ParameterResult& p) { return p.unconfirmed.has_value(); });
  if (!chosen.identified || doubtful) judge_identified(chosen, spans);
}

void settle_choice(Selection& s, const ProtocolSpans& spans, const ProfiledFit& with_profiles) {
  constexpr int kMostTried = 4;
  std::vector<bool> profiled(s.candidates.size(), false);
  const auto profile = [&](std::size_t i) {
    if (!with_profiles || profiled[i]) return;
    profiled[i] = true;
    s.candidates[i].fit = with_profiles(s.candidates[i].law);
    reassess(s.candidates[i], spans);
  };
  for (int tried = 0; with_profiles && tried < kMostTried; ++tried) {
    const auto next = refused_by_wald_alone(s, profiled);
    if (!next) break;
    profile(*next);
    s.recommended = least_within(s.candidates, s.margin);
  }
  // A law that its profiles no longer call identified gives way to the next one.
  for (int tried = 0; tried < kMostTried; ++tried) {
    profile(s.recommended);
    const std::size_t next = least_within(s.candidates, s.margin);
    if (next == s.recommended) break;
    s.recommended = next;
  }
  profile(s.recommended);
  s.preferred.reset();
  if (s.recommended == s.best_bic) return;
  if (!(s.candidates[s.recommended].delta_bic > kDecisiveBic)) return;
  s.preferred = s.best_bic;
  profile(s.best_bic);
  // Its own intervals may say that it is identified after all.
  if (!s.candidates[s.best_bic].identified) return;
  s.recommended = least_within(s.candidates, s.margin);
  profile(s.recommended);
  s.preferred.reset();
}

std::string least_law_words(const Selection& s, const std::string& data) {
  const Candidate& chosen = s.candidates[s.recommended];
  if (s.preferred) {
    const Candidate& best = s.candidates[*s.preferred];
    return fmt::format(
        "{} prefer {}, by {} in BIC, but do not identify its parameters ({}); the simplest law {} "
        "is",
        data, law_name(best.law), significant(chosen.delta_bic, 3), best.reason,
        chosen.identified     ? "whose parameters they identify"
        : chosen.contradicted ? "near the best BIC"
                              : "that the protocol does not contradict");
  }
  if (s.candidates.size() == 1) return "the law that was asked for is";
  if (chosen.unloading_refutes) {
    return fmt::format("of the loading alone the simplest law that {} support is", data);
  }
  if (chosen.fit.adequacy && chosen.fit.adequacy->is_rejected()) {
    return fmt::format("no law that is identified describes {}; the least of {} is",
                       data == "they" ? "them" : data, s.candidates.size());
  }
  if (chosen.identified) return fmt::format("the simplest law that {} support is", data);
  return fmt::format("{} identify none of the {} laws; near the best BIC the least{} is", data,
                     s.candidates.size(),
                     chosen.contradicted ? "" : " that the protocol does not contradict");
}

}  // namespace tpm::fit
