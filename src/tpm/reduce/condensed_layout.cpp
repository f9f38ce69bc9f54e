#include <algorithm>
#include <array>

#include "tpm/reduce/condensed_fit.hpp"

namespace tpm::organ {

static_assert(kCondensedDegrees == std::array<int, 4>{7, 5, 3, 1}, "the layout of the tables");
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
    const double c = potential.coefficients()[m];
    std::vector<int> across;  // the tangents in it, each as often as its power
    double factorials = 1.0;
    for (int t = 0; t < 4; ++t) {
      for (int n = 1; n <= e[static_cast<std::size_t>(t) + 2]; ++n) {
        across.push_back(t);
        factorials *= n;
      }
    }
    const double derivative = c * factorials;  // by all its tangents
    if (across.empty()) tables.constant[e[1]][e[0]] = c;
    if (across.size() == 1) tables.linear[e[0]][e[1]][across[0]] = c;
    if (across.size() == 2) {
      tables.square[e[0]][e[1]][across[0]][across[1]] = derivative;
      tables.square[e[0]][e[1]][across[1]][across[0]] = derivative;
    }
    if (across.size() != 3) continue;
    do {
      if (across[1] > across[2]) continue;
      constexpr std::array<int, 4> kFirstPair{0, 4, 7, 9};
      const int pair = kFirstPair[static_cast<std::size_t>(across[1])] + across[2] - across[1];
      tables.cube[e[0]][e[1]][pair][across[0]] = derivative;
    } while (std::next_permutation(across.begin(), across.end()));
  }
  for (Eigen::Index term = 0; term < CondensedMatrices::kTerms; ++term) {
    for (Eigen::Index entry = 0; entry < 18; ++entry) {
      tables.matrices[term][entry] = matrices.coefficients()(entry, term);
    }
  }
  return tables;
}

}  // namespace tpm::organ
