#pragma once
#include <vector>

#include "tpm/organ/bonds/bond_system.hpp"

namespace tpm::organ {

/// The viscous elongations m_j of a network as one vector y: bond by bond of those that relax, the
/// branches of a bond one after the other.
class ViscousElongations {
 public:
  using Vector = Eigen::VectorXd;
  using ConstVector = Eigen::Ref<const Eigen::VectorXd>;

  /// @param bonds must live as long as this
  explicit ViscousElongations(const BondSystem& bonds);

  [[nodiscard]] Eigen::Index size() const { return times_s_.size(); }
  [[nodiscard]] const Vector& times_s() const { return times_s_; }                ///< tau of each y
  [[nodiscard]] const std::vector<std::size_t>& bonds() const { return bonds_; }  ///< that relax

  /// Sets the mean of each bond, sum gamma_j y_j; what does not relax has 0.
  void set_mean(const ConstVector& y, Vector& mean) const;
  /// The same of shares that follow the elongation within a step, which bonds of a law have alike.
  [[nodiscard]] RelaxationFactor mean_relaxation_factor(const ConstVector& relaxation_factor) const;
  /// Copies a value of the bonds to each y.
  void spread(const Vector& of_bond, Vector& of_y) const;

 private:
  struct One {
    std::size_t bond;
    double share;  ///< gamma_j
  };
  std::vector<One> ones_;
  std::vector<std::size_t> bonds_;
  /// The first y of a bond of each law, and how many it has.
  struct OfLaw {
    std::size_t first = 0, count = 0;
  };
  std::vector<OfLaw> of_law_;
  Eigen::Index all_bonds_;
  Vector times_s_;
};

}  // namespace tpm::organ
