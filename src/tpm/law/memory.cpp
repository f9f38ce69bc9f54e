#include "tpm/law/memory.hpp"

#include <numeric>

namespace tpm {

Memory branch_memory(bool solid, int branches, std::span<const double> parallel) {
  const Eigen::Index n = branches;
  const int first = solid ? 1 : 0;
  Memory m;
  m.constant = solid ? parallel[0] : 0.0;
  m.rate_per_s.resize(n);
  m.stiffness.resize(n);
  m.by.resize(static_cast<std::size_t>(first + branches));
  std::iota(m.by.begin(), m.by.end(), 0);
  m.d_stiffness.setZero(n, first + n);
  m.d_constant.setZero(first + n);
  m.d_dashpot.setZero(first + n);
  if (solid) m.d_constant[0] = 1.0;
  for (int j = 0; j < branches; ++j) {
    m.stiffness[j] = parallel[static_cast<std::size_t>(first + j)];
    m.rate_per_s[j] = 1.0 / parallel[static_cast<std::size_t>(first + branches + j)];
    m.rate_parameter.push_back(first + branches + j);
    m.d_stiffness(j, first + j) = 1.0;
  }
  return m;
}

}  // namespace tpm
