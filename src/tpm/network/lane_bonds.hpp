#pragma once
#include <vector>

#include "tpm/network/bond_system.hpp"
#include "tpm/solve/lanes.hpp"

namespace tpm {

/// The bonds of a system, working on several states of the network at once. Positions and forces
/// have three columns per sphere; elongations and memories have one column per bond that relaxes,
/// in the order of relaxing_bonds().
class LaneBonds {
 public:
  explicit LaneBonds(const BondSystem& bonds);

  /// The bonds with g > 0, by their number in the system.
  [[nodiscard]] const std::vector<std::size_t>& relaxing_bonds() const { return relaxing_; }

  /// The values that belong to relaxing bonds.
  [[nodiscard]] Eigen::VectorXd of_relaxing(const Eigen::VectorXd& all) const;

  /// l of the relaxing bonds.
  void elongations(const LaneMatrix& position, LaneMatrix& elongation) const;

  /// Adds what all bonds pull their spheres with, N.
  /// @param memory y of the relaxing bonds, m
  void add_forces(const LaneMatrix& position, const LaneMatrix& memory, LaneMatrix& force) const;

 private:
  struct Data {
    std::uint32_t a, b;
    double rest_length_m, k, g;
    double least;  ///< elongation below which the bond is slack, m
  };
  std::vector<std::size_t> relaxing_;
  std::vector<Data> bond_;  ///< the relaxing ones first
};

}  // namespace tpm
