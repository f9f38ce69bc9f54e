#pragma once
#include <vector>

#include "tpm/network/bond_system.hpp"
#include "tpm/solve/lanes.hpp"

namespace tpm {

/// The bonds of a system, working on several states of the network at once, over which the same
/// contacts with tools are closed. Positions and forces
/// have three columns per sphere; elongations and memories have one column per bond that relaxes,
/// in the order of relaxing_bonds().
class LaneBonds {
 public:
  explicit LaneBonds(const BondSystem& bonds);

  /// Says which contacts are closed, as BondMemory::closed; at first none is.
  void close_contacts(std::span<const char> closed);

  /// The bonds with g > 0, by their number in the system.
  [[nodiscard]] const std::vector<std::size_t>& relaxing_bonds() const { return relaxing_; }

  /// The values that belong to relaxing bonds.
  [[nodiscard]] Eigen::VectorXd of_relaxing(const Eigen::VectorXd& all) const;

  /// Values of all bonds but contacts in the order in which this works: the relaxing ones first.
  [[nodiscard]] Eigen::VectorXd in_order(const Eigen::VectorXd& all) const;

  /// l of the relaxing bonds.
  void elongations(const LaneMatrix& position, LaneMatrix& elongation) const;

  /// Adds what all bonds pull their spheres with, N.
  /// @param memory y of the relaxing bonds, m
  void add_forces(const LaneMatrix& position, const LaneMatrix& memory, LaneMatrix& force) const;

  /// Changes of l of the relaxing bonds with small displacements of the spheres.
  void elongation_changes(const LaneMatrix& position, const LaneMatrix& displacement,
                          LaneMatrix& change) const;

  /// Adds the change of what all bonds pull their spheres with, N, with small displacements of the
  /// spheres, changes of y of the relaxing bonds, and changes of k and g of all, in_order().
  void add_force_changes(const LaneMatrix& position, const LaneMatrix& memory,
                         const LaneMatrix& displacement, const LaneMatrix& memory_change,
                         const Eigen::VectorXd& k_change, const Eigen::VectorXd& g_change,
                         LaneMatrix& force) const;

 private:
  struct Data {
    std::uint32_t a, b;
    double rest_length_m, k, g;
    double least;  ///< elongation below which the bond is slack, m
  };
  /// How a contact lies in every lane.
  struct Lie {
    Eigen::Matrix<double, kLanes, 3> direction;
    LaneVector overlap_force, turning;  ///< N (negative), N/m
  };
  [[nodiscard]] Lie lie(const ToolContact& contact, const LaneMatrix& position) const;

  std::vector<ToolContact> contacts_, closed_;
  std::vector<std::size_t> relaxing_;
  std::vector<Data> bond_;           ///< the relaxing ones first
  std::vector<std::size_t> number_;  ///< of each in the system
};

}  // namespace tpm
