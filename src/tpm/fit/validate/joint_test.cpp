#include "tpm/fit/validate/joint_test.hpp"

#include <algorithm>
#include <limits>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::fit {
namespace {

/// True if a quantity varies by itself: a share of its variance is not explained by the others.
bool adds_to(const Eigen::MatrixXd& c, const std::vector<Eigen::Index>& kept, Eigen::Index i) {
  if (!(c(i, i) > 0.0)) return false;
  if (kept.empty()) return true;
  constexpr double kLeast = 1e-4;
  const Eigen::MatrixXd among = c(kept, kept);
  const Eigen::VectorXd with = c(kept, i);
  const Eigen::VectorXd scale = among.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * among * scale.asDiagonal();
  const Eigen::VectorXd right = scale.cwiseProduct(with);
  const double explained = right.dot(Eigen::VectorXd(solve_symmetric(scaled, right)));
  return c(i, i) - explained > kLeast * c(i, i);
}

}  // namespace

std::vector<std::size_t> test_together(JointTest& joint, const Eigen::VectorXd& error,
                                       const Eigen::MatrixXd& covariance,
                                       const std::vector<bool>& follows, double degrees) {
  std::vector<std::size_t> left_out;
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < follows.size(); ++i) {
    const auto place = static_cast<Eigen::Index>(i);
    if (follows[i] || !adds_to(covariance, kept, place)) {
      left_out.push_back(i);
    } else {
      kept.push_back(place);
    }
  }
  joint.rank = static_cast<int>(kept.size());
  if (kept.empty()) return left_out;
  const Eigen::MatrixXd c = covariance(kept, kept);
  const Eigen::VectorXd e = error(kept);
  joint.t_squared = e.dot(Eigen::VectorXd(solve_symmetric(c, e)));
  const double p = static_cast<double>(joint.rank);
  constexpr double kMany = 1e7;
  if (degrees < kMany && degrees - p + 1.0 > 0.0) {
    joint.degrees = degrees - p + 1.0;
    joint.f = joint.t_squared * joint.degrees / (degrees * p);
    joint.p_value = fisher_tail(std::max(joint.f, 0.0), p, joint.degrees);
  } else if (degrees >= kMany) {
    joint.degrees = std::numeric_limits<double>::infinity();
    joint.f = joint.t_squared / p;
    joint.p_value = chi_squared_tail(std::max(joint.t_squared, 0.0), p);
  } else {
    joint.rank = 0;
  }
  return left_out;
}

}  // namespace tpm::fit
