#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tpm::fit {

/// Estimate of one parameter from one specimen, in theta (ln E, say).
struct SpecimenEstimate {
  std::string name;
  double estimate = 0.0;
  double standard_error = 0.0;  ///< > 0
  std::string specimen = {};    ///< whose repeat this is; empty: the name says it
};

/// Limits in theta.
struct EffectInterval {
  double lower = 0.0, upper = 0.0;
};

/// The estimate over specimens that differ, y_i = mu + u_i + e_i with u_i ~ N(0, tau^2) and
/// e_i ~ N(0, s_i^2). Everything in theta; for a log parameter exp(mu) is the typical specimen.
struct RandomEffects {
  std::size_t specimens = 0;          ///< k
  double mean = 0.0;                  ///< mu
  double standard_error = 0.0;        ///< of mu, Hartung-Knapp
  EffectInterval interval;            ///< of mu
  std::optional<double> tau_squared;  ///< between specimens, by REML; empty for k = 1
  bool tau_at_zero = false;           ///< the boundary: no spread beyond the standard errors
  /// Test of spread between specimens: Cochran's Q and its p-value (chi-square, k - 1); with
  /// repeats Q over the mean square between repeats (F, k - 1 and repeat_degrees).
  std::optional<double> q, q_p_value;
  std::optional<double> repeat_variance;       ///< between repeats, beyond their standard errors
  int repeat_degrees = 0;                      ///< repeats less the specimens that have them
  std::optional<double> i_squared;             ///< max(0, (Q - (k - 1)) / Q), 0 .. 1
  std::optional<EffectInterval> new_specimen;  ///< prediction interval; empty for k < 3
  std::string summary;                         ///< one sentence
};

/// tau^2 maximises the restricted likelihood (Viechtbauer, J. Educ. Behav. Stat. 30 (2005) 261).
/// The interval of mu is mu +- t_{k-1} SE with Hartung and Knapp's SE^2 = h / sum w, w = 1 / (s^2 +
/// tau^2), h = max(1, sum w (y - mu)^2 / (k - 1)) (Statistics in Medicine 20 (2001) 3875; the lower
/// limit of 1 keeps few specimens that agree by chance from giving no interval at all: Roever,
/// Knapp and Friede, BMC Med. Res. Methodol. 15 (2015) 99). A new specimen: mu +- t_{k-1}
/// sqrt(tau^2 + SE^2). One specimen answers with its own estimate and the normal interval of its
/// standard error.
/// @param level in (0, 1)
/// Throws Error(bad_input) without specimens, or naming one whose numbers are not finite or whose
/// standard error is not positive.
[[nodiscard]] RandomEffects random_effects(std::span<const SpecimenEstimate> specimens,
                                           double level = 0.95);

/// Weighted sums over estimates, w = 1 / (s^2 + tau^2).
struct WeightedMean {
  double weights = 0.0;  ///< sum w
  double mean = 0.0;
  double squares = 0.0;       ///< sum w (y - mean)^2
  double log_variance = 0.0;  ///< sum ln(s^2 + tau^2)
};
[[nodiscard]] WeightedMean weighted_mean(std::span<const SpecimenEstimate> specimens,
                                         double tau_squared);

/// Throws Error(bad_input) as random_effects().
void require_estimates(std::span<const SpecimenEstimate> specimens, double level);

/// One estimate for each specimen of repeats, its weighted mean, in the order of their first
/// repeats; the variance between repeats beyond their standard errors, and its degrees of freedom.
struct SpecimenMeans {
  std::vector<SpecimenEstimate> specimens;
  double repeat_variance = 0.0;
  int repeat_degrees = 0;  ///< 0: no specimen was recorded twice
};
[[nodiscard]] SpecimenMeans specimen_means(std::span<const SpecimenEstimate> repeats);

/// tau^2, common to all groups, that maximises the restricted likelihood of groups with a mean
/// each. Of one group it is that of random_effects().
/// @param groups none of them empty, standard errors > 0, at least one more specimen than groups
[[nodiscard]] double restricted_tau_squared(std::span<const std::vector<SpecimenEstimate>> groups);

/// The same where specimens were recorded repeatedly (SpecimenEstimate::specimen). Repeats differ
/// by more than their standard errors: y_ij = mu + u_i + r_ij + e_ij with r_ij ~ N(0, rho^2), rho^2
/// by moments within the specimens (DerSimonian and Laird 1986, pooled). A specimen is the weighted
/// mean of its repeats, w = 1/(s^2 + rho^2). Spread between specimens is tested against the mean
/// square between repeats, which is exact for equal standard errors whatever rho is. Without any
/// repeats it is random_effects().
[[nodiscard]] RandomEffects random_effects_of_repeats(std::span<const SpecimenEstimate> repeats,
                                                      double level = 0.95);

}  // namespace tpm::fit
