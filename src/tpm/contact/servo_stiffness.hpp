#pragma once
#include <memory>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/servo_bonds.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/linear/frontal_factor.hpp"

namespace tpm::contact {

/// The spheres of a tissue in the order in which servo models keep them, and its stiffness at one
/// position, factorised for many solutions (FrontalFactor).
class ServoStiffness {
 public:
  /// @param constraints fixed spheres do not move
  ServoStiffness(const BondSystem& bonds, const Constraints& constraints);

  /// To be called before solve(), with bonds and constraints as before. False if the tissue is not
  /// stiff there.
  [[nodiscard]] bool factorise(const BondSystem& bonds, const Constraints& constraints,
                               const Positions& position, const ViscousState& viscous_state,
                               bool portable);

  /// Spheres that move, in the order of the organ; they have the first columns.
  [[nodiscard]] const std::vector<std::size_t>& free() const { return free_; }
  [[nodiscard]] bool moves(std::size_t sphere) const { return column_[sphere] < free_.size(); }
  [[nodiscard]] std::uint32_t column(std::size_t sphere) const { return column_[sphere]; }
  [[nodiscard]] std::size_t columns() const { return column_.size(); }
  /// Replaces forces by displacements, four floats per sphere that moves. Allocates nothing.
  void solve(float* four_per_sphere) noexcept;
  /// 3x3 blocks that a solution reads.
  [[nodiscard]] std::size_t blocks_read() const { return FrontalFactor::blocks_read(*fronts_); }

 private:
  /// A sphere that may move in some directions only.
  struct Partly {
    std::size_t column;
    Eigen::Matrix3f projector;
  };
  void project(float* four_per_sphere) const noexcept;

  std::vector<std::size_t> free_;
  std::vector<std::uint32_t> column_;
  std::vector<Partly> partly_;
  std::vector<FrontalFactor::Edge> edges_;  ///< bonds whose ends both move, by their ranks in free_
  std::shared_ptr<const EliminationFronts> fronts_;
  std::unique_ptr<FrontalFactor> factor_;
};

}  // namespace tpm::contact
