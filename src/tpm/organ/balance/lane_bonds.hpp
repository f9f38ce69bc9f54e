#pragma once
#include <vector>

#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/linear/lanes.hpp"

namespace tpm::organ {

/// The bonds of a system, working on several states of the network at once, over which the same
/// contacts with tools are closed. Positions and forces have three columns per sphere; what bonds
/// follow, V(l) (l where nothing stiffens), and mean viscous elongations y have one column per bond
/// that relaxes, in the order of relaxing_bonds().
class LaneBonds {
 public:
  explicit LaneBonds(const BondSystem& bonds);

  /// Says which contacts are closed, as ViscousState::closed; at first none is.
  void close_contacts(std::span<const char> closed);

  /// The bonds with g > 0, by their number in the system, those of one law together.
  [[nodiscard]] const std::vector<std::size_t>& relaxing_bonds() const { return relaxing_; }

  /// The relaxing bonds of one law: columns first to first + count.
  struct Group {
    std::size_t law = 0;  ///< of the system
    Eigen::Index first = 0, count = 0;
  };
  [[nodiscard]] const std::vector<Group>& groups() const { return groups_; }

  /// The values that belong to relaxing bonds.
  [[nodiscard]] Eigen::VectorXd of_relaxing(const Eigen::VectorXd& all) const;

  /// Values of all bonds but contacts in the order in which this works: the relaxing ones first.
  [[nodiscard]] Eigen::VectorXd in_order(const Eigen::VectorXd& all) const;

  /// l of the relaxing bonds.
  void elongations(const LaneMatrix& position, LaneMatrix& elongation) const;
  /// V(l) of the relaxing bonds.
  void followed(const LaneMatrix& position, LaneMatrix& followed) const;

  /// Elongations that y of the relaxing bonds of one group follows within a step.
  struct Following {
    const ViscousWeights* weights;  ///< of y
    const double* followed;         ///< V(l) at the start of the step, by relaxing bond
    const double* mean;             ///< y there
    /// The part of y that the start decides, by (lane, relaxing bond); null: it follows from the
    /// two above, as with one branch.
    const double* known;
  };
  /// followed(), y by `Following::weights`, and add_forces() with it, in one sweep. Only where no
  /// bond stiffens (is_linear()).
  /// @param groups one for each of groups()
  void add_forces_of_stages(const LaneMatrix& position, std::span<const Following> groups,
                            LaneMatrix& followed, LaneMatrix& force) const;
  /// No bond stiffens: V(l) = l.
  [[nodiscard]] bool is_linear() const { return linear_; }

  /// Adds what all bonds pull their spheres with, N.
  /// @param mean_viscous y of the relaxing bonds, m
  void add_forces(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                  LaneMatrix& force) const;

  /// Energy stored in the bonds and closed contacts if every branch had its bond's mean viscous
  /// elongation, J. Only where no bond stiffens (is_linear()).
  [[nodiscard]] LaneVector stored_J(const LaneMatrix& position,
                                    const LaneMatrix& mean_viscous) const;

  /// Changes of V(l) of the relaxing bonds with small displacements of the spheres and changes of
  /// the laws.
  void followed_changes(const LaneMatrix& position, const LaneMatrix& displacement,
                        std::span<const LawChange> laws, LaneMatrix& change) const;

  /// Small changes of everything that forces depend on.
  struct Changes {
    const LaneMatrix& displacement;    ///< of the spheres
    const LaneMatrix& mean;            ///< of y of the relaxing bonds
    const Eigen::VectorXd& stiffness;  ///< of k of all bonds, in_order()
    const Eigen::VectorXd& relaxing;   ///< of g of all bonds, in_order()
    std::span<const LawChange> laws;   ///< of each law
  };
  /// Adds the change of what all bonds pull their spheres with, N.
  void add_force_changes(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                         const Changes& changes, LaneMatrix& force) const;

 private:
  friend struct LaneBondKernels;
  struct Data {
    std::uint32_t a, b;
    double rest_length_m, k, g;
    double least;  ///< elongation below which the bond is slack, m
    std::size_t law;
  };
  /// Geometry of a contact in every lane.
  struct ContactGeometry {
    Eigen::Matrix<double, kLanes, 3> direction;
    LaneVector overlap_force, turning;  ///< N (negative), N/m
  };
  [[nodiscard]] ContactGeometry contact_geometry(const ToolContact& contact,
                                                 const LaneMatrix& position) const;

  void add_contact_forces(const LaneMatrix& position, LaneMatrix& force) const;
  template <bool kLinear>
  void add_bond_forces(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                       LaneMatrix& force) const;
  template <bool kLinear>
  void add_bond_force_changes(const LaneMatrix& position, const LaneMatrix& mean_viscous,
                              const Changes& changes, LaneMatrix& force) const;

  std::vector<ToolContact> contacts_, closed_;
  std::vector<ViscousLaw> laws_;
  bool linear_;
  std::vector<std::size_t> relaxing_;
  std::vector<Group> groups_;
  std::vector<Data> bond_;           ///< the relaxing ones first
  std::vector<std::size_t> number_;  ///< of each in the system
};

}  // namespace tpm::organ
