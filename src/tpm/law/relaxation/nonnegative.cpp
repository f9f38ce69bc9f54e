#include "tpm/law/relaxation/nonnegative.hpp"

#include <algorithm>
#include <vector>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

/// The least squares solution with the columns outside `used` held at 0.
Eigen::VectorXd solve_used(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                           const std::vector<bool>& used) {
  std::vector<Eigen::Index> columns;
  for (std::size_t j = 0; j < used.size(); ++j) {
    if (used[j]) columns.push_back(static_cast<Eigen::Index>(j));
  }
  Eigen::MatrixXd part(a.rows(), std::ssize(columns));
  for (std::size_t j = 0; j < columns.size(); ++j) {
    part.col(static_cast<Eigen::Index>(j)) = a.col(columns[j]);
  }
  const Eigen::VectorXd solution = least_squares(part, b);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(a.cols());
  for (std::size_t j = 0; j < columns.size(); ++j) {
    x[columns[j]] = solution[static_cast<Eigen::Index>(j)];
  }
  return x;
}

}  // namespace

Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  const Eigen::Index n = a.cols();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<bool> used(static_cast<std::size_t>(n), false);
  const double small = 1e-13 * a.cwiseAbs().maxCoeff() * b.norm();
  for (Eigen::Index step = 0; step < 10 * n; ++step) {
    const Eigen::VectorXd pull = a.transpose() * (b - a * x);
    Eigen::Index best = -1;
    for (Eigen::Index j = 0; j < n; ++j) {
      const bool candidate = !used[static_cast<std::size_t>(j)] && pull[j] > small;
      if (candidate && (best < 0 || pull[j] > pull[best])) best = j;
    }
    if (best < 0) return x;
    used[static_cast<std::size_t>(best)] = true;
    // Towards the solution of the used columns, as far as all stay positive; what reaches 0 leaves.
    for (;;) {
      const Eigen::VectorXd wanted = solve_used(a, b, used);
      double share = 1.0;
      for (Eigen::Index j = 0; j < n; ++j) {
        if (used[static_cast<std::size_t>(j)] && wanted[j] <= 0.0) {
          share = std::min(share, x[j] / (x[j] - wanted[j]));
        }
      }
      if (share == 1.0) {
        x = wanted;
        break;
      }
      x += share * (wanted - x);
      for (Eigen::Index j = 0; j < n; ++j) {
        if (used[static_cast<std::size_t>(j)] && x[j] <= 1e-15 * x.maxCoeff()) {
          x[j] = 0.0;
          used[static_cast<std::size_t>(j)] = false;
        }
      }
      // A column that leaves as soon as it entered was pulled by rounding only.
      if (!used[static_cast<std::size_t>(best)]) return x;
    }
  }
  throw Error(ExitCode::numerical, "least squares", "the non-negative solution was not found");
}

}  // namespace tpm::law
