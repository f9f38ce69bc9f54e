#pragma once
#include <functional>
#include <string>

#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// Above this difference of BIC a law is not recommended alone (Kass & Raftery, J. Am. Stat. Assoc.
/// 90 (1995) 773: very strong evidence).
inline constexpr double kDecisiveBic = 10.0;

/// Sets `identified`, `reason`, `by_wald`, `special` and `contradicted` of a candidate that was
/// fitted.
void judge_identified(Candidate& candidate, const ProtocolSpans& spans);

/// Fits a law again with profiles.
using ProfiledFit = std::function<FitResult(const LawSpec&)>;

/// Settles what is recommended of candidates that are ranked. A law that would be recommended but
/// for a standard error (a Wald test) is fitted with profiles, and its intervals decide. Where the
/// law of the lowest BIC is not recommended and is ahead by more than kDecisiveBic, it is set as
/// `preferred`, with its intervals.
/// @param with_profiles empty: no profiles are wanted, and standard errors decide
void settle_choice(Selection& s, const ProtocolSpans& spans, const ProfiledFit& with_profiles);

}  // namespace tpm::fit
