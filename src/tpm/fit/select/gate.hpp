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

/// Of ranked candidates: sets `unloading_refutes` of the laws without memory whose unloading is off
/// by more than the law of the lowest BIC leaves in the loading (unloading_off). Where that law is
/// among them, laws with memory that describe the loading as well (within kDecisiveBic) go before
/// it only if they describe loading and unloading together (both_off). Recommends anew.
void judge_unloading(Selection& s, std::span<const PreparedRecording> recordings,
                     const SetupOptions& setup);

/// "hertz-1 describes the unloading, but is behind by 368 in BIC of the loading", or "hertz-1
/// describes both if it is fitted to both, ...": of the lowest BIC; empty if none does. Where
/// judge_unloading() has refuted the law of the lowest BIC.
[[nodiscard]] std::string law_of_unloading(const Selection& s);

/// Fits a law again with profiles.
using ProfiledFit = std::function<FitResult(const LawSpec&)>;

/// Settles what is recommended of candidates that are ranked. A law that would be recommended but
/// for a standard error (a Wald test) is fitted with profiles, and its intervals decide. Where the
/// law of the lowest BIC is not recommended and is ahead by more than kDecisiveBic, it is set as
/// `preferred`, with its intervals.
/// @param with_profiles empty: no profiles are wanted, and standard errors decide
void settle_choice(Selection& s, const ProtocolSpans& spans, const ProfiledFit& with_profiles);

}  // namespace tpm::fit
