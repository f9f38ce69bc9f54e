#pragma once
// The inside of QuasiStatic: the tissue under its probe.
#include "tpm/network/quasistatic.hpp"
#include "tpm/solve/lanes.hpp"

namespace tpm {

/// The tissue at an instant.
struct TissueState {
  double time_s = 0.0;
  double imposed = 0.0;  ///< depth, m, or load, N
  Positions position;
  Eigen::VectorXd elongation;  ///< l of each bond, m
  Eigen::VectorXd remembered;  ///< y of each bond, m
};

/// A network with one sphere driven: by an imposed depth, whose response is the contact force, or
/// by a load, whose response is the depth.
class DrivenTissue {
 public:
  DrivenTissue(const BondSystem& bonds, Positions rest, Freedom freedom, const Probe& probe,
               Drive drive);
  DrivenTissue(const DrivenTissue&) = delete;
  DrivenTissue& operator=(const DrivenTissue&) = delete;

  [[nodiscard]] TissueState at_rest(double time_s) const;
  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Freedom& freedom() const { return freedom_; }
  [[nodiscard]] const Probe& probe() const { return probe_; }
  [[nodiscard]] bool depth_driven() const { return drive_ == Drive::displacement; }
  [[nodiscard]] Equilibrium& equilibrium() { return equilibrium_; }

  /// Puts the driven sphere where an imposed depth wants it; under a load there is nothing to do.
  void impose(Positions& position, double imposed) const;
  /// Forces from outside, N.
  void load(double imposed, Eigen::Matrix3Xd& force) const;

  /// The same for states side by side, one imposed value each; loads are added.
  void impose(LaneMatrix& position, const LaneVector& imposed) const;
  void add_load(const LaneVector& imposed, LaneMatrix& force) const;
  /// Puts the displacement of the driven sphere to a change of an imposed depth.
  void impose_change(LaneMatrix& displacement, const LaneVector& change) const;

  /// Contact force or depth, given the forces on all spheres.
  [[nodiscard]] double response(const Positions& position, const Eigen::Matrix3Xd& force) const;
  [[nodiscard]] double response(const TissueState& state) const;
  [[nodiscard]] LaneVector response(const LaneMatrix& position, const LaneMatrix& force) const;
  /// The change of the response, given small displacements and the change of the forces.
  [[nodiscard]] LaneVector response_change(const LaneMatrix& displacement,
                                           const LaneMatrix& force) const;

  /// The displacements per unit of what is imposed (probe included), from the last factorisation;
  /// with the sign that makes them the adjoint of the response: a force R left on the free spheres
  /// changes it by -(+) their product under an imposed depth (load).
  void unit_field(const TissueState& state, const BondMemory& memory, Eigen::Matrix3Xd& field,
                  double& stiffness) const;
  [[nodiscard]] double adjoint_sign() const { return depth_driven() ? -1.0 : 1.0; }

  /// Force on the driven sphere per displacement along the probe while all others stand still, N/m.
  [[nodiscard]] double held_stiffness(const Positions& position, const BondMemory& memory) const;

  /// Size of the response to a peak of what is imposed, with the relaxed stiffness at rest.
  [[nodiscard]] double linear_response(const TissueState& rest, double peak);

 private:
  const BondSystem& bonds_;
  Positions rest_;
  Freedom freedom_;
  Probe probe_;
  Drive drive_;
  Equilibrium equilibrium_;
};

}  // namespace tpm
