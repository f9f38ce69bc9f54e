#pragma once
#include <span>

#include "tpm/fit/groups/random_effects.hpp"

namespace tpm::fit {

/// Distance between the means of two groups of specimens lie apart, in theta: of a log parameter
/// exp() is the ratio of the typical specimens. y_i = mu_g + u_i + e_i with u_i ~ N(0, tau^2) in
/// both groups and e_i ~ N(0, s_i^2).
struct GroupDifference {
  std::size_t first = 0, second = 0;  ///< specimens
  double difference = 0.0;            ///< mean of the second group less that of the first
  double standard_error = 0.0;        ///< modified Hartung-Knapp
  EffectInterval interval;
  double tau_squared =
      0.0;               ///< common to both groups, by REML; 0: no spread beyond standard errors
  double degrees = 0.0;  ///< first + second - 2
  double p_value = 1.0;  ///< two-sided, of "no difference"
};

/// tau^2 by restricted_tau_squared(); the difference of the weighted means, w = 1/(s^2 + tau^2),
/// with SE^2 = h (1/sum_1 w + 1/sum_2 w), h = max(1, sum w (y - mean of its group)^2 / (n - 2)),
/// and Student's t with n - 2 degrees of freedom: Knapp and Hartung, Statistics in Medicine 22
/// (2003) 2693, with the lower limit of 1 of Roever, Knapp and Friede, BMC Med. Res. Methodol. 15
/// (2015) 99. Error(bad_input) with less than two specimens in a group, or as random_effects().
/// @param level in (0, 1)
[[nodiscard]] GroupDifference group_difference(std::span<const SpecimenEstimate> first,
                                               std::span<const SpecimenEstimate> second,
                                               double level = 0.95);

}  // namespace tpm::fit
