#pragma once
#include <Eigen/Core>

#include "tpm/benchmark/contact_motions.hpp"
#include "tpm/network/equilibrium.hpp"

namespace tpm {

/// A tissue and the sphere at which it is touched.
struct TouchedTissue {
  const BondSystem& bonds;
  const Positions& rest;
  const Freedom& freedom;  ///< without the probe
  std::size_t contact = 0;
};

/// Forces of the full network on its contact under a motion.
struct ContactReference {
  Eigen::Matrix3Xd force_N;  ///< at the end of each period
  double error_N = 0.0;      ///< estimate of the largest error
  [[nodiscard]] double peak_N() const { return force_N.colwise().norm().maxCoeff(); }
};

/// The quasi-static network in double precision with many steps a period: elongations are linear
/// in a step, under which what is remembered is advanced exactly, and forces are balanced by
/// Newton's method with a factorisation that is found anew when it converges slowly.
class FineContact {
 public:
  /// @param tissue must live as long as this
  FineContact(const TouchedTissue& tissue, double step_s);

  /// Force of the tissue on the contact, N, after one step to a displacement.
  /// Throws Error(numerical) if the forces cannot be balanced.
  Eigen::Vector3d step(const Eigen::Vector3d& displacement_m);

  [[nodiscard]] const Positions& position() const { return position_; }
  /// Energy in the springs and power of the dashpots where it stands.
  [[nodiscard]] double stored_J() const;

 private:
  const TouchedTissue& tissue_;
  Freedom freedom_;
  Equilibrium equilibrium_;
  double keep_, of_start_, of_end_;
  Positions position_;
  Eigen::VectorXd elongation_;
  Eigen::VectorXd remembered_;
  bool factorised_ = false;
};

/// By FineContact with `substeps` and twice as many steps a period, extrapolated (the error falls
/// with the square of the step); the error is estimated by what the extrapolation changes.
[[nodiscard]] ContactReference fine_reference(const TouchedTissue& tissue,
                                              const ContactMotion& motion, int substeps);

/// By QuasiStatic, for a motion along a line: the part of the force along it.
/// @param tolerance of QuasiStatic, in parts of the peak
[[nodiscard]] Eigen::VectorXd line_reference(const TouchedTissue& tissue,
                                             const ContactMotion& motion, double tolerance);

}  // namespace tpm
