// Decompositions of small dense matrices that are compiled once.
#include <Eigen/Core>
#include <catch2/catch.hpp>
#include <optional>

#include "tpm/base/dense_algebra.hpp"

namespace tpm::base {

TEST_CASE("A positive definite matrix has its inverse, another one none") {
  const Eigen::MatrixXd root = (Eigen::MatrixXd(3, 3) << 2, 0, 0, 1, 3, 0, -1, 0.5, 1).finished();
  const Eigen::MatrixXd positive = root * root.transpose();
  const std::optional<Eigen::MatrixXd> inverse = positive_inverse(positive);
  REQUIRE(inverse);
  CHECK((positive * *inverse).isApprox(Eigen::MatrixXd::Identity(3, 3), 1e-13));
  Eigen::MatrixXd indefinite = positive;
  indefinite(1, 1) = -1.0;
  CHECK_FALSE(positive_inverse(indefinite));
  // The lower triangle is read.
  Eigen::MatrixXd lower = positive.triangularView<Eigen::Lower>();
  lower(0, 2) = 7.0;
  CHECK(positive_inverse(lower)->isApprox(*inverse, 1e-15));
}

}  // namespace tpm::base
