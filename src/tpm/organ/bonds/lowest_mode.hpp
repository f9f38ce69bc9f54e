#pragma once
#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/bonds/constraints.hpp"

namespace tpm::organ {

/// kg, one per sphere: a density times the volume of the spheres.
/// @param density_kg_per_m3 > 0; 1060 is that of liver (docs/notation.md)
[[nodiscard]] Eigen::VectorXd sphere_masses_kg(const Organ& organ,
                                               double density_kg_per_m3 = 1060.0);

/// The slowest free vibration of a network about rest.
struct LowestMode {
  double frequency_Hz = 0.0;
  /// Share of the relaxing stiffness that has relaxed at that frequency, of each law the sum of
  /// gamma_j/(1 + (omega tau_j)^2).
  RelaxationFactor relaxation_factor;
  /// Displacements of the spheres (of tools 0), modal mass 1: the sum of m |shape|^2 is 1 kg (m^2).
  /// Up to sign, and within their span where several modes have one frequency.
  Eigen::Matrix3Xd shape;

  [[nodiscard]] double angular_frequency() const;  ///< rad/s
};

/// Tools are left out: what they weigh and how stiff their contacts are is not the tissue's.
///
/// Solves K(omega) shape = omega^2 M shape for the smallest omega, where K is the storage stiffness
/// that the bonds have at this frequency: a vibrating bond resists with k - g sum_j gamma_j/(1 +
/// (omega tau_j)^2). What its dashpot takes out of the motion is left out.
///
/// Inverse iteration of a few vectors at once, by the factorisation of K (Bathe, Finite Element
/// Procedures, section 11.6), inside a fixed-point iteration for omega.
/// @param rest positions at which every bond has its rest length
/// @param mass_kg one per sphere, > 0
/// @param converged relative change of omega^2 at which the iteration ends, 1e-13 to 1e-3
/// Throws Error(bad_input) for a network with zero-energy modes, Error(numerical) if an iteration
/// does not converge.
[[nodiscard]] LowestMode lowest_mode(const BondSystem& bonds, const Positions& rest,
                                     const Constraints& constraints, const Eigen::VectorXd& mass_kg,
                                     double converged = 1e-13);

}  // namespace tpm::organ
