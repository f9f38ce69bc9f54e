#pragma once
#include <optional>
#include <span>
#include <vector>

#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/experiment.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law.hpp"

namespace tpm::fit {

/// The first unloading behind the fitted part of a recording, beside its prediction.
struct UnloadingTest {
  std::size_t choice = 0;  ///< the recording, place in FitConfig::data
  double times = 0.0;      ///< root of the mean square of the contrasts, each in its own
                           ///< standard error; about 1 if the law is right
  double off_peak = 0.0;   ///< rms difference over the largest fitted response
  double p_value = 1.0;    ///< of a difference at least this large if the law is right
};

/// Tests whether a law with memory predicts the unloading that it was not fitted to.
///
/// The samples between the end of the fitted part and the loss of contact are averaged in at most
/// 10 blocks of equal length. With the averages b of prediction less reading, the correlation R of
/// the noise (autoregressive of first order), its variance s^2, the averaging W, the covariance C
/// of the fitted parameters and the sensitivity J of the prediction to them,
///
///     F = b' V^-1 b / K,   V = s^2 W R W' + (W J) C (W J)',
///
/// is compared with the F distribution of K and nu degrees of freedom; phi, the correlation of
/// neighbours, is estimated from n residuals (Satterthwaite):
///
///     2 / nu = 4 (1 + phi) / ((1 - phi) n) + 2 / (n - p).
///
/// Samples end where the drive rises again or returns to where the fit begins, and where prediction
/// or reading has fallen to a fifth of the peak: contact may be lost there, or the probe adheres.
///
/// @param data one data set for each of the fit's
/// @return one test of each recording that has at least 8 such samples; none of an imposed load, of
///         a law without memory (hysteresis_of), or where the residuals are no plain differences or
///         the parameters have no covariance
[[nodiscard]] std::vector<UnloadingTest> test_unloading(const FitResult& fit,
                                                        const std::vector<DataSet>& data);

/// True for a law with branches or a fractional element.
[[nodiscard]] bool has_memory(const LawSpec& law);

/// How far a law's prediction of the unloading behind the fitted part is off.
struct UnloadingOff {
  std::size_t samples = 0;  ///< compared, of all recordings; 0: nothing was tested
  double times = 0.0;       ///< the residual of the loading: largest ratio that is no chance; or 0
  /// "the unloading is off by 68 times the residual of the loading", or empty
  [[nodiscard]] std::string words() const;
};

/// Compares the median residual of the first unloading, down to the drive at which the fitted part
/// begins, with the residual of the loading (F test at 1 %). The parameters count as known: for the
/// unloading that a law with memory predicts see test_unloading().
/// @param closest the fit whose residuals are the noise of the loading, of the same recordings: of
///        several laws that of the lowest BIC, lest a bad law is excused by its own residuals
[[nodiscard]] UnloadingOff unloading_off(const FitResult& fit, const FitResult& closest);

/// Whether a law describes loading and unloading together: from the loading alone its parameters,
/// and so the unloading that it predicts, may hardly be known. It is fitted again to both, until
/// the drive turns or the response has fallen to a fifth of the peak (contact may be lost there, or
/// the probe adheres), and its residuals are compared with the noise of the loading (F test at 1
/// %).
/// @param fit of the loading
/// @param closest as in unloading_off()
/// @return "the unloading is off by ..., and by 12 times if it is fitted, too"; empty if it does
[[nodiscard]] std::string both_off(const FitResult& fit, const FitResult& closest,
                                   std::span<const PreparedRecording> recordings,
                                   SetupOptions setup);

/// A law without memory answers each depth with one force, in unloading as in loading: a hysteresis
/// behind the fitted part contradicts it, whatever makes it (relaxation, adhesion), and what it
/// calls the equilibrium.
/// @return what is seen (unloading_off); empty if nothing speaks against the law, or it has a
/// memory
[[nodiscard]] std::string hysteresis_of(const FitResult& fit);

}  // namespace tpm::fit
