#pragma once
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/figure.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpm/sweep/sweep_convergence.hpp"

namespace tpm::sweep {

/// For each number a table over the sizes: order, extrapolated value and grid convergence index of
/// the three sizes that end there, and a sentence on what they tell.
[[nodiscard]] std::string convergence_text(const std::vector<SweepConvergence>& all);
/// That table of one number; of several, the sentence of each.
[[nodiscard]] ShortAnswer short_answer(const std::vector<SweepConvergence>& all,
                                       const std::string& title);
[[nodiscard]] Json convergence_json(const std::vector<SweepConvergence>& all);

/// For each number: the values over the size with the extrapolated one, and, where the finest three
/// are monotone, their distances from it on logarithmic scales.
[[nodiscard]] std::vector<Figure> convergence_figures(const std::vector<SweepConvergence>& all,
                                                      const std::string& title);

}  // namespace tpm::sweep
