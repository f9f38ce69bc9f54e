#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/correlation.hpp"
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Prediction of other data by a law that was fitted to some data.
struct HeldOut {
  std::string what;  ///< "muscle_100s, fitted to the others", "second half of the hold"
  double rms = 0.0;  ///< of the prediction error, SI
  double rms_over_peak = 0.0;
  double rms_standardised = 0.0;  ///< in standard deviations, where the data have their own
  double rms_if_fitted = 0.0;     ///< of the residual where the law is fitted to these data, too
};

/// One law of the contest.
struct Candidate {
  LawSpec law;
  FitResult fit;        ///< without profiles, except for the recommended law
  bool failed = false;  ///< no start ended in a usable point
  std::string reason;   ///< why it failed, or why it is not a law of its own
  int parameters = 0;   ///< estimated, nuisance and noise size included
  double rms_over_peak = 0.0;
  double aicc = 0.0, bic = 0.0;              ///< with the effective number of readings
  double delta_aicc = 0.0, delta_bic = 0.0;  ///< above the best
  /// No material parameter at a bound or dependent on a nuisance parameter at one, covariance of
  /// full rank, each stiffness more than two standard errors above 0 (k_inf beside branches may be
  /// 0), each relaxation time sampled by kLeastSamples; of a fluid, a hold that shows its end.
  bool identified = true;
  /// A relaxation time below the sampling, a fluid from a hold too short to tell, or an unloading
  /// that refutes the law.
  bool contradicted = false;
  bool by_wald = false;  ///< a standard error alone speaks against it, no profile yet
  /// The unloading behind the fitted part is not what the law predicts (judge_unloading); the
  /// parameters may be known from the loading all the same.
  bool unloading_refutes = false;
  std::string special;  ///< what simpler law it is there ("the spring-pot is a dashpot"), or empty
  std::vector<HeldOut> held_out;
};

/// Both answers where the recordings do not tell a drift of the zero from a slow branch.
struct DriftAnswers {
  double k_inf = 0.0;               ///< without a drift, SI
  std::optional<double> drifting;   ///< with one of each recording, SI; none if no fit was found
  std::vector<double> drift_per_s;  ///< of each recording that has one, SI
  Unit rate;                        ///< in which a drift is shown
};

struct SelectionOptions {
  std::vector<LawSpec> laws;  ///< empty: the classical family
  bool only_listed = false;   ///< do not try laws without plateau besides
  double margin = 3.0;        ///< how much of BIC a larger law must gain to be preferred
  bool held_out = true;
  bool drift_answers = true;  ///< fit the chosen law again with a drift, where no rest tells one
  SetupOptions setup;
};

struct Selection {
  std::vector<Candidate> candidates;  ///< rising BIC; failed ones last
  std::size_t recommended = 0;        ///< place in candidates
  std::size_t best_bic = 0;
  /// The law of the lowest BIC, where it is ahead of the recommended one by more than kDecisiveBic:
  /// the data prefer it but do not identify its parameters, and both answers are given.
  std::optional<std::size_t> preferred;
  double margin = 3.0;
  int samples = 0;  ///< fitted
  double effective_count = 0.0;
  Correlation correlation;            ///< of the residuals that the law of least deviance leaves
  std::optional<DriftAnswers> drift;  ///< of the recommended law, if not separable
  std::vector<std::string> summary;   ///< the recommendation and its reasons
  std::size_t recommendation = 0;     ///< place in the summary of the sentence that recommends
  std::vector<Remark> remarks;        ///< what the experiment cannot tell, and outside_remarks()
};

/// linear, hertz and power kernels with 0 to 3 branches; linear also with elastic and relaxing
/// tension.
[[nodiscard]] std::vector<LawSpec> classical_family();
/// The four fractional elements on the three kernels.
[[nodiscard]] std::vector<LawSpec> fractional_family();

/// Where the lasting stiffness of a law of the family is not told from 0, the law without it
/// (NAME-fluid) is fitted, too.
///
/// Fits every law to the recordings together and recommends the least: of the laws whose parameters
/// are identified (or, if none is, of those that the protocol does not contradict, or of all), the
/// one with the fewest parameters whose BIC is within the margin of the best of these. Where the
/// unloading refutes the law of the lowest BIC, laws that are behind it by more than kDecisiveBic
/// are left out: they do not describe the loading. AICc and BIC
/// count the effective number of readings, because neighbouring residuals repeat each other; with n
/// samples of n_eff effective ones, -2 ln L = n_eff ln(RSS/n).
///
/// Held-out error: with several recordings each in turn is predicted from the others (its own
/// nuisance parameters refitted, the material fixed); with one the second half of its hold is
/// predicted from the rest.
[[nodiscard]] Selection select_law(std::span<const PreparedRecording> recordings,
                                   const SelectionOptions& wanted);

[[nodiscard]] Json to_json(const Selection& selection);
[[nodiscard]] std::string to_terminal_text(const Selection& selection);

/// One law fitted; that no start ends in a usable point is a reason against it.
/// @param refusal_counts that it has no answer at a reading (bad input) is one, too
[[nodiscard]] Candidate fit_candidate(const FitConfig& config, const std::vector<DataSet>& data,
                                      bool refusal_counts = false);

/// Fits a law again with a linear drift of the zero of each recording that holds, within what its
/// rests tell; nothing if the fit separates the two already. The drift moves every coefficient of
/// the law: the interval of each then holds both answers, or, where one of them has no interval,
/// the coefficient is not identified.
std::optional<DriftAnswers> give_both_drift_answers(FitResult& fit,
                                                    std::span<const PreparedRecording> recordings);

/// @param data what was fitted, one for each of the recordings
std::optional<DriftAnswers> give_both_drift_answers(FitResult& fit,
                                                    std::span<const PreparedRecording> recordings,
                                                    const std::vector<DataSet>& data);

/// The same for a configuration whose parameters say `not_separable`, with a flag that says both.
/// Nothing if one of its data is no recording of a motion.
void give_both_drift_answers(FitResult& fit, const std::vector<DataSet>& data);

[[nodiscard]] std::string drift_words(const DriftAnswers& answers, const FitResult& fit);

/// The law that select_law recommends with a given margin of BIC.
/// @param candidates in any order, with their scores
/// @return place in candidates. Throws Error(numerical) if no law could be fitted.
[[nodiscard]] std::size_t least_within(const std::vector<Candidate>& candidates, double margin);

/// True if the lasting stiffness k_inf is not told from 0.
[[nodiscard]] bool plateau_is_not_told(const FitResult& fit);

/// Scores the candidates by s.samples and s.effective_count, sorts them by BIC and recommends one
/// (least_within s.margin).
/// @param few_readings the penalty k ln n of BIC is k ln n times n / (n - k - 1), k with the size
/// of
///        the noise: McQuarrie, Statistics & Probability Letters 44 (1999) 79
void rank_candidates(Selection& s, bool few_readings = false);

/// Misfit of the fitted law outside the window: "unloading and after: rms 12 % of
/// the peak; the law does not describe it", and which of them it does not predict. Empty if there
/// are none.
[[nodiscard]] std::vector<Remark> outside_remarks(const FitResult& fit);

/// "; not the unloading and what follows: off by 95 times that residual", to be appended to a
/// verdict on the fitted part: of the recording whose samples after that part lie farthest from the
/// prediction, where their rms exceeds three residuals. Empty if there is none.
[[nodiscard]] std::string not_after_fit(const FitResult& fit);

/// Fewer samples over a relaxation time than these cannot support it.
inline constexpr int kLeastSamples = 3;

/// Time spans that the protocols of recordings can resolve, at best.
struct ProtocolSpans {
  double ramp_s = 0.0;  ///< shortest; infinite without a ramp
  double hold_s = 0.0;  ///< longest; 0 without a hold, infinite without a protocol
  double step_s = 0.0;  ///< shortest mean distance of samples in a phase

  [[nodiscard]] bool samples_too_far_for(double time_s) const {
    return time_s < kLeastSamples * step_s;
  }
  /// The hold is shorter than three relaxation times: no plateau is seen, nor that there is none.
  [[nodiscard]] bool too_short_to_end(double time_s) const { return time_s > hold_s / 3.0; }
};

/// Of the fitted parts.
[[nodiscard]] ProtocolSpans protocol_spans(std::span<const PreparedRecording> recordings);

/// "the simplest law that the data support is", or what else the recommended law is.
[[nodiscard]] std::string least_law_words(const Selection& s, const std::string& data);

/// The first reason why a material parameter of a fit is not known; empty if all are. By the
/// interval of a parameter where its profile found one, else by the linearised standard error.
[[nodiscard]] std::string not_identified(const Candidate& candidate, const ProtocolSpans& spans);

/// Looks again at a recommended law that was not identified, now that its fit has profiles: its
/// note must not contradict its intervals.
void reassess(Candidate& chosen, const ProtocolSpans& spans);

/// Remarks about the recordings themselves: PreparedRecording::remarks, and depths in a
/// unit that is not the file's.
[[nodiscard]] std::vector<Remark> recording_remarks(std::span<const PreparedRecording> recordings);

/// k_inf is an extrapolation by the law's last branch where the hold ends before that has relaxed
/// (its time is over a third of the hold): any slower branch would change it. It is then not
/// identified, whatever its interval (ParameterResult::not_separable).
void doubt_plateau(FitResult& fit, const ProtocolSpans& spans);

/// Properties of a fitted law that the protocol of a recording cannot resolve: relaxation times
/// shorter than the ramp or the sampling, or longer than the hold.
[[nodiscard]] std::vector<Remark> protocol_remarks(const FitResult& fit,
                                                   std::span<const PreparedRecording> recordings);

}  // namespace tpm::fit
