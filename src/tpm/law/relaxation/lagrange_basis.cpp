#include "tpm/law/relaxation/lagrange_basis.hpp"

namespace tpm::law {

LagrangeBasis::LagrangeBasis(std::vector<double> nodes)
    : nodes_(std::move(nodes)), scale_(static_cast<Eigen::Index>(nodes_.size())) {
  for (Eigen::Index k = 0; k < scale_.size(); ++k) {
    scale_[k] = others(nodes_[static_cast<std::size_t>(k)])[k];
  }
}

/// For each node, the product of c less all the others.
Eigen::VectorXd LagrangeBasis::others(double c) const {
  const auto n = static_cast<Eigen::Index>(nodes_.size());
  Eigen::VectorXd product(n);
  double before = 1.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    product[k] = before;
    before *= c - nodes_[static_cast<std::size_t>(k)];
  }
  double behind = 1.0;
  for (Eigen::Index k = n - 1; k >= 0; --k) {
    product[k] *= behind;
    behind *= c - nodes_[static_cast<std::size_t>(k)];
  }
  return product;
}

Eigen::VectorXd LagrangeBasis::at(double c) const {
  // As products: powers of c would cancel. At a node the same product stands above and below.
  return others(c).cwiseQuotient(scale_);
}

}  // namespace tpm::law
