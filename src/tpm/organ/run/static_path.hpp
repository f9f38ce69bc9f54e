#pragma once
#include "tpm/organ/balance/driven_tissue.hpp"

namespace tpm::organ {

/// The fully relaxed equilibria of a network along what is imposed, followed in strides over which
/// the driven sphere moves by no more than a twentieth of the spacing, so that no instability is
/// stepped over.
class StaticPath {
 public:
  /// @param bonds must live as long as this
  /// @param rest of spheres and tools
  /// @param peak of what will be imposed, m or N: the force left on a sphere is a thousandth of the
  ///        tolerance, in parts of the load or of the force that the peak meets at small depth
  StaticPath(const BondSystem& bonds, Positions rest, double spacing_m,
             const Constraints& constraints, const Probes& probes, Drive drive, double peak,
             double tolerance, EquilibriumOptions equilibrium = {});

  [[nodiscard]] const SolverChoice& solver() { return tissue_.equilibrium().choice(); }

  /// Goes on from a state of an earlier path instead of from rest.
  void start_from(const QuasiStaticState& state);

  /// Moves to another imposed value.
  /// @param time_s of the state, and for messages
  /// Throws Error(numerical) where the tissue buckles or snaps through.
  [[nodiscard]] QuasiStaticState move_to(double imposed, double time_s);

 private:
  [[nodiscard]] bool stride_to(double imposed);

  DrivenTissue tissue_;
  TissueState state_;
  double longest_move_m_;
  double tolerance_N_;
  bool unstable_ = false;  ///< the latest stride failed by a stiffness that is not positive
};

}  // namespace tpm::organ
