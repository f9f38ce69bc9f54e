#include "tpm/contact/condensed/condensed_monomials.hpp"

namespace tpm::contact {

std::vector<CondensedExponents> condensed_monomials(std::span<const int> depth_degree) {
  std::vector<CondensedExponents> all;
  for (int b = 0; b < static_cast<int>(depth_degree.size()); ++b) {
    const int highest = depth_degree[static_cast<std::size_t>(b)];
    for (int i = b; i >= 0; --i) {
      for (int j = b - i; j >= 0; --j) {
        for (int k = b - i - j; k >= 0; --k) {
          for (int a = 0; a <= highest; ++a) {
            for (int n = 0; n <= a; ++n) all.push_back({a - n, n, i, j, k, b - i - j - k});
          }
        }
      }
    }
  }
  return all;
}

CondensedPowers::CondensedPowers(const CondensedFrame& frame, const Eigen::Vector3d& u_m,
                                 const Eigen::Vector3d& w_m) {
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double middle = i == 0 ? frame.middle_depth_m : 0.0;
    const double scale = frame.scale_m(kCondensedOfU[i]);
    of_[static_cast<std::size_t>(kCondensedOfU[i])][1] = (u_m[row] - middle) / scale;
    of_[static_cast<std::size_t>(kCondensedOfW[i])][1] = (w_m[row] - middle) / scale;
  }
  for (auto& powers : of_) {
    powers[0] = 1.0;
    for (std::size_t n = 2; n < powers.size(); ++n) powers[n] = powers[n - 1] * powers[1];
  }
}

double CondensedPowers::monomial(CondensedExponents e, int by, int again) const {
  double factor = 1.0;
  for (const int c : {by, again}) {
    if (c < 0) continue;
    int& power = e[static_cast<std::size_t>(c)];
    if (power == 0) return 0.0;
    factor *= power--;
  }
  for (std::size_t c = 0; c < e.size(); ++c) factor *= of_[c][static_cast<std::size_t>(e[c])];
  return factor;
}

}  // namespace tpm::contact
