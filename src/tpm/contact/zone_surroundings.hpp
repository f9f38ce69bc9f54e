#pragma once
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/pushed_contact.hpp"

namespace tpm::contact {

/// Some bonds of a tissue as linear springs with viscous state, about an equilibrium.
class LinearBonds {
 public:
  /// @param chosen one entry a bond: it takes part
  LinearBonds(const PushedContact& tissue, const Positions& position, double relaxed,
              const std::vector<char>& chosen);

  /// Adds what they resist displacements with, N: at once less `relaxation_factor` times what
  /// relaxes.
  void add_resistance(const Eigen::Matrix3Xd& displacement, double relaxation_factor,
                      Eigen::Matrix3Xd& force) const;
  /// What relaxes of it.
  void add_relaxing(const Eigen::Matrix3Xd& displacement, Eigen::Matrix3Xd& force) const;
  /// The stiffness matrix of the system's spheres.
  [[nodiscard]] BlockMatrix matrix(double relaxation_factor) const;

 private:
  struct Linear {
    std::size_t bond;
    std::uint32_t a, b;
    Eigen::Matrix3d instantaneous, relaxing;
  };
  const BondSystem& bonds_;
  std::vector<Linear> linear_;
};

}  // namespace tpm::contact
