#pragma once
#include <Eigen/Core>
#include <vector>

namespace tpm::organ {

/// Anderson acceleration of a fixed-point iteration x <- x + d(x) (Walker and Ni 2011): the step
/// that would have brought the latest few d's nearest to 0, were d linear. Differences are kept in
/// single precision, which is enough for a correction; sums of their products are in double.
class Anderson {
 public:
  /// @param size of x
  /// @param depth how many earlier steps are stored, >= 1
  Anderson(Eigen::Index size, Eigen::Index depth);

  void restart() { known_ = -1; }

  /// Replaces x, where the plain step would be d, by the accelerated next point.
  void step(Eigen::Ref<Eigen::VectorXd> x, const Eigen::Ref<const Eigen::VectorXd>& d);

 private:
  /// Stores the latest differences; what the stored ones have in common with them and with d is
  /// put into `gram_` and `aimed_`.
  void store(const double* x, const double* d);

  Eigen::Index size_, depth_, stride_;  ///< columns are filled up with zeros
  std::vector<float> dg_;               ///< columns of differences of x + d
  std::vector<float> dd_;               ///< columns of differences of d
  Eigen::MatrixXd gram_;                ///< products of the columns of dd_
  Eigen::VectorXd aimed_;               ///< products of d and the columns of dd_
  Eigen::VectorXd last_x_, last_d_;
  Eigen::Index known_ = -1;  ///< differences so far; -1 before the first point
};

}  // namespace tpm::organ
