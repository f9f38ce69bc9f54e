#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/balance/equilibrium.hpp"

namespace tpm::contact {

/// Response of a tissue to small displacements of its contact sphere.
struct ContactFields {
  /// Of every sphere per displacement of the contact along x, y and z.
  std::array<Eigen::Matrix3Xd, 3> displacement;
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  ///< at the contact, N/m
};

/// A tissue pushed at one of its spheres to given places: what reduced models are built from.
class PushedContact {
 public:
  /// @param constraints of the tissue without the probe
  /// @param contact a sphere that is free
  /// Throws Error(bad_input) for tools among the bonds, a contact that is not free, or bonds that
  /// do not have their rest length.
  PushedContact(const BondSystem& bonds, Positions rest, Constraints constraints,
                std::size_t contact);
  PushedContact(const PushedContact&) = delete;
  PushedContact& operator=(const PushedContact&) = delete;

  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Positions& rest() const { return rest_; }
  /// With the contact fixed.
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }
  [[nodiscard]] std::size_t contact() const { return contact_; }

  /// The equilibrium with the contact displaced, found along a straight line from rest or from the
  /// nearest of those found before with the same `relaxed`.
  /// @param relaxed how far the viscous elongations have caught up: 0 instantaneous, 1 equilibrium
  /// Throws Error(numerical) where the tissue buckles or none is found.
  [[nodiscard]] Positions at(const Eigen::Vector3d& displacement_m, double relaxed);
  /// The viscous elongations at such an equilibrium.
  /// @param relaxation_factor stiffness of changes about it: 0 instantaneous, 1 equilibrium
  [[nodiscard]] ViscousState viscous_state(const Positions& position, double relaxed,
                                           double relaxation_factor) const;
  /// About such an equilibrium. Throws Error(numerical) if the tissue is not stiff there.
  [[nodiscard]] ContactFields fields(const Positions& position, const ViscousState& viscous_state);
  /// Replaces forces by the displacements of what is free under them, with the stiffness of the
  /// last fields().
  void displace(Eigen::Matrix3Xd& forces) const { equilibrium_.displace(forces); }

 private:
  struct Found {
    double relaxed;
    Eigen::Vector3d displacement_m;
    Positions position;
  };
  const BondSystem& bonds_;
  Positions rest_;
  Constraints constraints_;
  std::size_t contact_;
  Equilibrium equilibrium_;
  std::vector<Found> found_;
};

}  // namespace tpm::contact
