#pragma once
#include <Eigen/Core>
#include <algorithm>

#include "tpm/core/dense_algebra.hpp"

namespace tpm {

/// Anderson acceleration of a fixed-point iteration x <- x + d(x) (Walker and Ni 2011): the step
/// that would have brought the latest few d's nearest to 0, were d linear.
class Anderson {
 public:
  /// @param size of x
  /// @param depth how many earlier steps are stored, >= 1
  Anderson(Eigen::Index size, Eigen::Index depth)
      : dx_(size, depth), dd_(size, depth), gram_(depth, depth), last_x_(size), last_d_(size) {}

  void restart() { known_ = -1; }

  /// Replaces x, where the plain step would be d, by the accelerated next point.
  void step(Eigen::Ref<Eigen::VectorXd> x, const Eigen::Ref<const Eigen::VectorXd>& d) {
    if (known_ >= 0) store(x, d);
    ++known_;
    last_x_ = x;
    last_d_ = d;
    const Eigen::Index used = std::min(known_, dx_.cols());
    x += d;
    if (used == 0) return;
    const auto differences = dd_.leftCols(used);
    const Eigen::MatrixXd gram = gram_.topLeftCorner(used, used);
    const Eigen::VectorXd mix = shortest_least_squares(gram, differences.transpose() * d);
    x.noalias() -= dx_.leftCols(used) * mix;
    x.noalias() -= differences * mix;
  }

 private:
  void store(const Eigen::Ref<Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& d) {
    const Eigen::Index slot = known_ % dx_.cols();
    const Eigen::Index used = std::min(known_ + 1, dx_.cols());
    dx_.col(slot) = x - last_x_;
    dd_.col(slot) = d - last_d_;
    gram_.col(slot).head(used).noalias() = dd_.leftCols(used).transpose() * dd_.col(slot);
    gram_.row(slot).head(used) = gram_.col(slot).head(used).transpose();
  }

  Eigen::MatrixXd dx_, dd_;
  Eigen::MatrixXd gram_;  ///< products of the columns of dd_
  Eigen::VectorXd last_x_, last_d_;
  Eigen::Index known_ = -1;  ///< differences so far; -1 before the first point
};

}  // namespace tpm
