#pragma once
#include <Eigen/Core>

#include "tpm/accuracy/contact_motions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/organ/balance/equilibrium.hpp"

namespace tpm::accuracy {

/// A tissue and the sphere at which it is touched.
struct TouchedTissue {
  const BondSystem& bonds;
  const Positions& rest;
  const Constraints& constraints;  ///< without the probe
  std::size_t contact = 0;
};

/// Forces of the full network on its contact under a motion.
struct ContactReference {
  Eigen::Matrix3Xd force_N;  ///< at the end of each period
  double error_N = 0.0;      ///< estimate of the largest error, if there is one
  /// Of all spheres, three numbers each, at the end of every so many periods, if asked for.
  Eigen::MatrixXd displacement_m = {};
  [[nodiscard]] double peak_N() const { return force_N.colwise().norm().maxCoeff(); }
};

/// The network balanced under its viscous elongations, by Newton's method with a factorisation that
/// is found anew when it converges slowly.
class BalancedContact {
 public:
  /// @param tissue must live as long as this
  explicit BalancedContact(const TouchedTissue& tissue);

  /// Goes to a displacement of the contact, m.
  /// @returns force of the tissue on the contact, N
  /// Throws Error(numerical) if the forces cannot be balanced.
  Eigen::Vector3d go_to(const Eigen::Vector3d& displacement_m, const ViscousState& viscous_state);

  [[nodiscard]] const Positions& position() const { return position_; }

 private:
  const TouchedTissue& tissue_;
  Constraints constraints_;
  Equilibrium equilibrium_;
  Positions position_;
  bool factorised_ = false;
};

/// The quasi-static network in double precision with many steps a period: elongations are linear
/// in a step, under which viscous elongations are advanced exactly.
class FineContact {
 public:
  /// @param tissue must live as long as this
  FineContact(const TouchedTissue& tissue, double step_s);

  /// Force of the tissue on the contact, N, after one step to a displacement.
  /// Throws Error(numerical) if the forces cannot be balanced.
  Eigen::Vector3d step(const Eigen::Vector3d& displacement_m);

  [[nodiscard]] const Positions& position() const { return balanced_.position(); }
  /// Energy in the springs and power of the dashpots where it stands.
  [[nodiscard]] double stored_J() const;

 private:
  const BondSystem& bonds_;
  BalancedContact balanced_;
  double keep_, of_start_, of_end_;
  Eigen::VectorXd elongation_;
  Eigen::VectorXd viscous_;
};

/// By FineContact with `substeps` and twice as many steps a period, extrapolated (the error falls
/// with the square of the step); the error is estimated by what the extrapolation changes.
/// @param field_every periods between those at whose end all displacements are told; 0: none
[[nodiscard]] ContactReference fine_reference(const TouchedTissue& tissue,
                                              const ContactMotion& motion, int substeps,
                                              Eigen::Index field_every = 0);

/// By Runge-Kutta's rule of order 4 for the viscous elongations, the forces balanced at each stage:
/// it shares no integrator with FineContact. The error is not estimated.
/// @param substeps a period; @param field_every as above
/// Throws Error(numerical) if the forces cannot be balanced.
[[nodiscard]] ContactReference runge_kutta_reference(const TouchedTissue& tissue,
                                                     const ContactMotion& motion, int substeps,
                                                     Eigen::Index field_every = 0);

/// By QuasiStatic, for a motion along a line: the part of the force along it.
/// @param tolerance of QuasiStatic, in parts of the peak
[[nodiscard]] Eigen::VectorXd line_reference(const TouchedTissue& tissue,
                                             const ContactMotion& motion, double tolerance);

}  // namespace tpm::accuracy
