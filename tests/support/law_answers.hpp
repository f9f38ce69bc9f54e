#pragma once
#include <Eigen/Core>
#include <vector>

namespace tpm::test {

/// `count` numbers from `from` to `to`, both included.
inline std::vector<double> evenly(double from, double to, int count) {
  std::vector<double> numbers;
  numbers.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) numbers.push_back(from + (to - from) * i / (count - 1));
  return numbers;
}

inline double largest(const Eigen::VectorXd& values) {
  return values.cwiseAbs().maxCoeff();
}

}  // namespace tpm::test
