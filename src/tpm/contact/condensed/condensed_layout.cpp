// Declared in tpm/contact/condensed/condensed_fit.hpp.
#include <algorithm>
#include <vector>

#include "tpm/contact/condensed/condensed_fit.hpp"

namespace tpm::contact {

static_assert(kCondensedDegrees[0] < CondensedTables::kDepths);
static_assert(CondensedMatrices::kTerms == CondensedTables::kMatrixTerms);

CondensedTables condensed_tables(const CondensedFrame& frame, const CondensedPotential& potential,
                                 const CondensedMatrices& matrices) {
  CondensedTables tables;
  tables.middle_depth_m = frame.middle_depth_m;
  tables.per_half_depth = 1.0 / frame.half_depth_m;
  tables.per_tangential = 1.0 / frame.tangential_m;
  const auto monomials = condensed_monomials(kCondensedDegrees);
  for (std::size_t m = 0; m < monomials.size(); ++m) {
    const CondensedExponents& e = monomials[m];
    std::vector<int> across;  // the tangents in it, each as often as its power
    double factorials = 1.0;
    for (int t = 0; t < 4; ++t) {
      for (int n = 1; n <= e[static_cast<std::size_t>(t) + 2]; ++n) {
        across.push_back(t);
        factorials *= n;
      }
    }
    const double derivative = potential.coefficients()[m] * factorials;  // by all its tangents
    CondensedColumn& column =
        tables.columns[static_cast<std::size_t>(e[0])][static_cast<std::size_t>(e[1])];
    do {
      if (across.empty()) column.constant = derivative;
      if (across.size() == 1) column.linear[across[0]] = derivative;
      if (across.size() == 2) column.square(across[0], across[1]) = derivative;
      if (across.size() == 3) column.cube(across[0], 4 * across[1] + across[2]) = derivative;
    } while (std::next_permutation(across.begin(), across.end()));
  }
  tables.matrices = matrices.coefficients();
  return tables;
}

}  // namespace tpm::contact
