#include "tpm/base/grid_convergence.hpp"

#include <algorithm>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <limits>

#include "tpmkit/error.hpp"

namespace tpm::base {
namespace {

constexpr double kSafety = 1.25;  // Roache: with three grids
constexpr double kLowestOrder = 0.05, kHighestOrder = 20.0;
constexpr double kRoundOff = 1e-14;  // of the solution

void check_grids(std::span<const double> spacing, std::span<const double> solution) {
  const std::string where = "a study of convergence";
  if (spacing.size() != 3 || solution.size() != 3)
    throw bad_input(where,
                    "has " + std::to_string(spacing.size()) + " sizes and " +
                        std::to_string(solution.size()) + " solutions",
                    "three of both");
  const auto finite = [](double v) { return std::isfinite(v); };
  if (!std::all_of(spacing.begin(), spacing.end(), finite) ||
      !std::all_of(solution.begin(), solution.end(), finite))
    throw bad_input(where, "has values that are not finite", "finite sizes and solutions");
  if (!(spacing[0] > spacing[1] && spacing[1] > spacing[2] && spacing[2] > 0.0))
    throw bad_input(where, "has sizes that do not fall", "sizes from coarse to fine, above 0");
}

}  // namespace

std::string to_string(GridConvergence::Behaviour behaviour) {
  switch (behaviour) {
    case GridConvergence::Behaviour::monotone:
      return "monotone";
    case GridConvergence::Behaviour::oscillating:
      return "oscillating";
    case GridConvergence::Behaviour::diverging:
      return "diverging";
    case GridConvergence::Behaviour::exact:
      break;
  }
  return "exact";
}

GridConvergence grid_convergence(std::span<const double> spacing,
                                 std::span<const double> solution) {
  check_grids(spacing, solution);
  const double coarser = spacing[0] / spacing[1], finer = spacing[1] / spacing[2];
  const double coarse_change = solution[1] - solution[0];
  const double fine_change = solution[2] - solution[1];
  GridConvergence g;
  g.extrapolated = solution[2];
  const double scale =
      std::max({std::abs(solution[0]), std::abs(solution[1]), std::abs(solution[2])});
  if (std::abs(fine_change) <= kRoundOff * scale && std::abs(coarse_change) <= kRoundOff * scale)
    return g;
  g.behaviour = coarse_change * fine_change < 0.0 ? GridConvergence::Behaviour::oscillating
                                                  : GridConvergence::Behaviour::monotone;
  // With an error C h^p: |coarse change / fine change| = (coarser^p - 1) / (1 - finer^-p), which
  // rises with p.
  const double ratio = std::abs(coarse_change / fine_change);
  const auto excess = [&](double p) {
    return (std::pow(coarser, p) - 1.0) / (1.0 - std::pow(finer, -p)) - ratio;
  };
  if (!(excess(kLowestOrder) < 0.0)) {
    g.behaviour = GridConvergence::Behaviour::diverging;
    g.index = std::numeric_limits<double>::infinity();
    return g;
  }
  if (excess(kHighestOrder) <= 0.0) {
    g.order = kHighestOrder;
  } else {
    std::uintmax_t most = 200;
    const auto bracket = boost::math::tools::toms748_solve(
        excess, kLowestOrder, kHighestOrder, boost::math::tools::eps_tolerance<double>(48), most);
    g.order = 0.5 * (bracket.first + bracket.second);
  }
  const double gain = std::pow(finer, g.order);
  const double error = std::abs(fine_change) / (gain - 1.0);
  // Where solutions swing around the limit, the limit lies between them and not beyond the finest.
  if (g.behaviour == GridConvergence::Behaviour::monotone)
    g.extrapolated = solution[2] + fine_change / (gain - 1.0);
  g.index = kSafety * error;
  return g;
}

}  // namespace tpm::base
