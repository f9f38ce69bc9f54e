#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {

/// Readings of recordings that are no noise about the curve: further from it than 8 standard
/// deviations, alone or up to three in a row on both sides, while the readings before and after are
/// within 4. The standard deviation is robust (1.4826 times the median of |residual|), of each
/// recording its own. Also single ones beyond 8 that leave the residuals beside them and return
/// (without_spikes), wherever these are: a spike in a short ramp bends the curve. Nothing of a
/// recording in which they would be more than one in twenty: then the law or the noise is wrong,
/// not the readings. Nor where the noise was declared to have wide tails, or a robust loss was
/// asked for.
/// @param natural the minimum, SI
/// @return places in function.data(), rising
[[nodiscard]] std::vector<std::size_t> isolated_outliers(const ExperimentResiduals& function,
                                                         std::span<const double> natural);

/// One sentence.
[[nodiscard]] std::string outlier_words(const ExperimentResiduals& function,
                                        std::span<const std::size_t> outliers);

}  // namespace tpm::fit
