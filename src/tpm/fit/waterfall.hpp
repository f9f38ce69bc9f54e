#pragma once
#include <span>
#include <string>
#include <vector>

namespace tpm::fit {

/// The ends of all starts in rising order: a stair with few broad steps means that the search finds
/// the same minima again and again, a slope without steps that it gets stuck anywhere (Raue et al.,
/// PLoS ONE 8 (2013) e74335).
struct Waterfall {
  std::vector<double> deviances;  ///< rising, of the starts that ended in a usable point
  std::vector<int> clusters;      ///< parallel: 0 for the best minimum, 1 for the next, ...
  double margin = 0.1;            ///< least height of its axis, of the deviance
  int at_best = 0;                ///< ends in the cluster of the best minimum
  int starts = 0;
  int failed = 0;       ///< starts without a usable end
  std::string summary;  ///< "17 of 50 starts end at the best minimum; ..."
};

/// Two ends belong to one cluster if their deviances differ by less than 1e-5, relative above 1.
/// @param deviances one per start in any order; not finite for a start that failed
[[nodiscard]] Waterfall waterfall(std::span<const double> deviances);

}  // namespace tpm::fit
