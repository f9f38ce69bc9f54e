#pragma once
// The inside of QuasiStatic: the tissue under its probe.
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/linear/lanes.hpp"

namespace tpm::organ {

/// The tissue at an instant.
struct TissueState {
  double time_s = 0.0;
  double imposed = 0.0;  ///< depth, m, or load, N
  Positions position;
  Eigen::VectorXd followed;  ///< V(l) of each bond, m: where nothing stiffens its elongation l
  Eigen::MatrixXd viscous;   ///< m_j by (bond, branch), m
  Eigen::VectorXd mean;      ///< y of each bond, the mean of its m_j, m
  std::vector<char> closed;  ///< contacts, as ViscousState::closed

  /// The viscous elongations at this instant.
  [[nodiscard]] ViscousState viscous_state() const { return {mean, 0.0, closed}; }
  /// Every viscous elongation is what it follows: nothing is left to relax.
  void set_equilibrium() {
    mean = followed;
    viscous = followed.replicate(1, viscous.cols());
  }
};

/// A network with spheres or tools driven: by an imposed depth, whose response is the contact
/// force, or by a load, whose response is the depth; see Probes. `imposed` is the coordinate of
/// path(): with one group of probes what is imposed itself.
class DrivenTissue {
 public:
  /// Throws Error(bad_input) if what an imposed depth drives touches nothing at rest, or if groups
  /// with histories of their own are among the probes.
  DrivenTissue(const BondSystem& bonds, Positions rest, Constraints constraints,
               const Probes& probes, Drive drive, EquilibriumOptions options = {});
  /// The same with several groups of probes; throws as ImposedPath does, too.
  DrivenTissue(const BondSystem& bonds, Positions rest, Constraints constraints,
               const Probes& probes, const Protocol& protocol, EquilibriumOptions options = {});
  DrivenTissue(const DrivenTissue&) = delete;
  DrivenTissue& operator=(const DrivenTissue&) = delete;

  [[nodiscard]] TissueState at_rest(double time_s) const;
  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }
  /// The depth, or its rate, that belongs to displacements, or velocities, of spheres and tools.
  [[nodiscard]] double depth_of(const Eigen::Matrix3Xd& displacement, std::size_t group = 0) const;
  [[nodiscard]] bool depth_driven(std::size_t group = 0) const { return path_.by_depth(group); }
  [[nodiscard]] Equilibrium& equilibrium() { return equilibrium_; }
  [[nodiscard]] const ImposedPath& path() const { return path_; }
  [[nodiscard]] std::size_t groups() const { return path_.groups(); }
  /// Loads that keep their size act: at rest the network is in equilibrium with them.
  [[nodiscard]] bool preloaded() const { return dead_N_.size() > 0; }
  /// Energy of those loads and of the springs at rest, to be added to what is stored, so that
  /// the account begins with 0, J.
  [[nodiscard]] double dead_energy_J(const Positions& position) const;
  /// Sum over the groups driven by a load of that times their depth, J.
  /// @param response of the first group
  [[nodiscard]] double loads_J(const Positions& position, double imposed, double response) const;
  /// Responses of the groups beside the first.
  [[nodiscard]] std::vector<double> beside_responses(const Positions& position,
                                                     const ViscousState& viscous_state,
                                                     double imposed) const;

  /// Puts what is driven where an imposed depth wants it; under a load there is nothing to do.
  void impose(Positions& position, double imposed) const;
  /// Forces from outside, N.
  void load(double imposed, Eigen::Matrix3Xd& force) const;

  /// The same for states side by side, one imposed value each; loads are added.
  void impose(LaneMatrix& position, const LaneVector& imposed) const;
  void add_load(const LaneVector& imposed, LaneMatrix& force) const;
  /// Puts the displacement of what is driven to a change of an imposed depth.
  void impose_change(LaneMatrix& displacement, const LaneVector& change) const;

  /// Contact force or depth of a group, given the forces on all spheres.
  [[nodiscard]] double response(const Positions& position, const Eigen::Matrix3Xd& force,
                                std::size_t group = 0) const;
  [[nodiscard]] double response(const TissueState& state) const;
  [[nodiscard]] LaneVector response(const LaneMatrix& position, const LaneMatrix& force,
                                    std::size_t group = 0) const;
  /// The change of the response, given small displacements and the change of the forces.
  [[nodiscard]] LaneVector response_change(const LaneMatrix& displacement, const LaneMatrix& force,
                                           std::size_t group = 0) const;

  /// Relation of depths and loads at a state.
  struct UnitField {
    /// The displacements per unit of what is imposed, probe included; with adjoint_sign() they are
    /// the adjoint of the response: a force R left on the free spheres changes it by that sign
    /// times their product.
    Eigen::Matrix3Xd displacement;
    /// Weights of errors: `displacement`; where the probe touches nothing and its response
    /// is nothing, that of a unit depth imposed on the spheres that it touched first.
    Eigen::Matrix3Xd adjoint;
    double stiffness = 0.0;  ///< work of `adjoint`: N/m under an imposed depth, m/N under a load
    double whole = 0.0;      ///< the same with the work of what is driven
  };
  /// From the last factorisation, which was at this state and viscous state.
  [[nodiscard]] UnitField unit_field(const TissueState& state, const ViscousState& viscous_state,
                                     std::size_t group = 0) const;
  [[nodiscard]] double adjoint_sign(std::size_t group = 0) const {
    return depth_driven(group) ? -1.0 : 1.0;
  }

  /// Force on what is driven per displacement along the probe while all else stands still, N/m.
  [[nodiscard]] double held_stiffness(const Positions& position, const ViscousState& viscous_state,
                                      std::size_t group = 0) const;

  /// Response per unit of what is imposed with the equilibrium stiffness at rest, given what the
  /// displacements are about: their errors count squared.
  [[nodiscard]] double relaxed_response(const TissueState& rest,
                                        const Eigen::Matrix3Xd& displacement,
                                        std::size_t group = 0) const;

  /// Size of the response to a peak of what is imposed, with the equilibrium stiffness at rest.
  [[nodiscard]] double linear_response(const TissueState& rest, double peak);

  /// Force on the tissue, N (or impulse, N s), given what the tissue does to what is driven: summed
  /// with the shares under an imposed depth, as the response is, and plainly under a load.
  [[nodiscard]] double push_on_tissue(const Eigen::Matrix3Xd& on_driven) const;
  /// The same times the speed of each imposed depth, summed over the groups: power, W, or work, J.
  /// @param imposed in the piece of the path
  [[nodiscard]] double power_on_tissue(const Eigen::Matrix3Xd& on_driven, double imposed,
                                       double rate) const;
  /// Speeds of what is driven where imposed depths change at a rate of the path's coordinate, added
  /// to velocities.
  /// @param imposed in the piece of the path
  void add_imposed_velocity(double imposed, double rate, Eigen::Matrix3Xd& velocity) const;
  /// Mass that the force of a probe accelerates, kg.
  [[nodiscard]] double driven_mass_kg(const Eigen::VectorXd& mass_kg) const;

 private:
  /// A sphere or tool driven.
  struct Driven {
    Eigen::Index column;
    Eigen::Vector3d direction;
    double weight;  ///< of what is imposed
  };
  DrivenTissue(const BondSystem& bonds, Positions rest, Constraints constraints,
               const Probes& probes, ImposedPath path, EquilibriumOptions options);
  void drive(std::span<const Probe> probes, std::size_t group);
  /// The parts of forces or displacements along what a group drives, weighted and summed.
  [[nodiscard]] double along(const Eigen::Matrix3Xd& vectors, std::size_t group) const;
  /// The displacements, or loads, of what is driven per unit of what is imposed on a group.
  [[nodiscard]] Eigen::Matrix3Xd unit(std::size_t group) const;
  /// The same on the spheres that are touched at rest.
  [[nodiscard]] Eigen::Matrix3Xd unit_on_touched(std::size_t group) const;
  [[nodiscard]] LaneVector values(std::size_t group, const LaneVector& imposed) const;

  const BondSystem& bonds_;
  Positions rest_;
  Constraints constraints_;
  ImposedPath path_;
  std::vector<std::vector<Driven>> driven_;  ///< of each group
  Eigen::Matrix3Xd dead_N_;
  double stored_at_rest_J_ = 0.0;  ///< where such loads act
  Equilibrium equilibrium_;
};

}  // namespace tpm::organ
