#pragma once
#include <Eigen/Core>
#include <vector>

#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/linear/lanes.hpp"

namespace tpm::organ {

/// Free directions of each sphere. In the other directions it is fixed or moves as imposed, and the
/// force there is a reaction.
class Constraints {
 public:
  /// All spheres free.
  explicit Constraints(std::size_t spheres);

  /// A copy with more spheres at the end, all free.
  [[nodiscard]] Constraints extended(std::size_t more) const;

  /// The constraints of the first spheres.
  [[nodiscard]] Constraints first(std::size_t spheres) const;

  /// Fixes the sphere.
  void fix(std::size_t sphere);
  /// Leaves only the motion along a unit direction free.
  void slide(std::size_t sphere, const Eigen::Vector3d& direction);
  /// The motion along a unit direction is imposed from outside. On a sliding sphere it is the
  /// direction of sliding.
  void impose(std::size_t sphere, const Eigen::Vector3d& direction);

  [[nodiscard]] std::size_t size() const { return state_.size(); }
  /// Free coordinates.
  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] bool is_free(std::size_t sphere) const { return state_[sphere] == State::free; }
  /// The orthogonal projector onto the free directions.
  [[nodiscard]] const Eigen::Matrix3d& projector(std::size_t sphere) const {
    return projector_[sphere];
  }

  /// Takes the part along what is not free out of vectors, one column per sphere.
  void project(Eigen::Ref<Eigen::Matrix3Xd> vectors) const;

  /// The same for states side by side, three columns per sphere.
  void project(LaneMatrix& vectors) const;

  /// P K P + s (1 - P): the stiffness that the free coordinates feel, and a harmless one elsewhere.
  /// @param matrix on bonds.pattern()
  void constrain(const BondSystem& bonds, BlockMatrix& matrix) const;

 private:
  enum class State { free, partly, fixed };
  std::vector<State> state_;
  std::vector<Eigen::Matrix3d> projector_;
};

}  // namespace tpm::organ
