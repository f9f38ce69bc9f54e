#include "tpm/organ/linear/preconditioners.hpp"

#include <Eigen/Cholesky>

namespace tpm::organ {
namespace {

constexpr double kFirstShift = 1e-3;
constexpr double kMostShift = 10.0;

}  // namespace

BlockJacobi::BlockJacobi(const BlockRows<3, 3>& matrix) : inverse_(inverse_diagonal(matrix)) {}

void BlockJacobi::apply(const BlockVector<3>& r, BlockVector<3>& z) const {
  z.resize(3, r.cols());
  for (Eigen::Index i = 0; i < r.cols(); ++i) {
    z.col(i).noalias() = inverse_[static_cast<std::size_t>(i)].lazyProduct(r.col(i));
  }
}

IncompleteCholesky::IncompleteCholesky(const BlockRows<3, 3>& matrix) {
  if (inverse_diagonal(matrix).empty()) return;
  while (!factorise(matrix)) {
    inverse_.clear();
    shift_ = shift_ == 0.0 ? kFirstShift : 2.0 * shift_;
    if (shift_ > kMostShift) return;
  }
}

bool IncompleteCholesky::factorise(const BlockRows<3, 3>& matrix) {
  const std::size_t n = matrix.rows();
  lower_ = {};
  lower_.columns = n;
  pivot_.assign(n, Eigen::Matrix3d::Zero());
  inverse_.assign(n, Eigen::Matrix3d::Zero());
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::size_t first = lower_.column.size();
    for (std::size_t p = matrix.begin[i]; p < matrix.begin[i + 1]; ++p) {
      const std::uint32_t k = matrix.column[p];
      if (k > i) break;
      Eigen::Matrix3d value = matrix.block[p];
      if (k == i) {
        value *= 1.0 + shift_;
        for (std::size_t q = first; q < lower_.column.size(); ++q) {
          value -= lower_.block[q] * pivot_[lower_.column[q]] * lower_.block[q].transpose();
        }
        const Eigen::LLT<Eigen::Matrix3d> factor(value);
        if (factor.info() != Eigen::Success) return false;
        pivot_[i] = value;
        inverse_[i] = factor.solve(Eigen::Matrix3d::Identity());
        break;
      }
      // Common entries of the rows i and k to the left of k.
      std::size_t q = first;
      for (std::size_t s = lower_.begin[k]; s < lower_.begin[k + 1]; ++s) {
        while (q < lower_.column.size() && lower_.column[q] < lower_.column[s]) ++q;
        if (q == lower_.column.size()) break;
        if (lower_.column[q] != lower_.column[s]) continue;
        value -= lower_.block[q] * pivot_[lower_.column[s]] * lower_.block[s].transpose();
      }
      lower_.column.push_back(k);
      lower_.block.push_back(value * inverse_[k]);
    }
    lower_.begin.push_back(lower_.column.size());
  }
  return true;
}

void IncompleteCholesky::apply(const BlockVector<3>& r, BlockVector<3>& z) const {
  z = r;
  const std::size_t n = lower_.rows();
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::Vector3d value = z.col(static_cast<Eigen::Index>(i));
    for (std::size_t p = lower_.begin[i]; p < lower_.begin[i + 1]; ++p) {
      value.noalias() -= lower_.block[p].lazyProduct(z.col(lower_.column[p]));
    }
    z.col(static_cast<Eigen::Index>(i)) = value;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    z.col(column) = (inverse_[i] * z.col(column)).eval();
  }
  for (std::size_t i = n; i-- > 0;) {
    const Eigen::Vector3d value = z.col(static_cast<Eigen::Index>(i));
    for (std::size_t p = lower_.begin[i]; p < lower_.begin[i + 1]; ++p) {
      z.col(lower_.column[p]).noalias() -= lower_.block[p].transpose().lazyProduct(value);
    }
  }
}

}  // namespace tpm::organ
