#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/condensed/condensed_branches.hpp"
#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpmkit/contact_model.hpp"

namespace tpm::contact {

/// Range and period that a condensed model is built for.
struct CondensedOptions {
  double depth_m = 8e-3;       ///< of the contact along the push, > 0
  double tangential_m = 2e-3;  ///< of the contact across it, > 0
  double period_s = 1e-3;      ///< of the servo loop, > 0
};

/// Viscous state of a condensed model, in the axes of its contact: into the tissue and two
/// tangents. Of several branches the mean, weighted by their shares.
struct CondensedViscousState {
  Eigen::Vector3d w_m = Eigen::Vector3d::Zero();  ///< fictitious displacement
  Eigen::Vector3d q_m = Eigen::Vector3d::Zero();  ///< along the second mode
  double spread_J = 0.0;  ///< energy stored in the differences of the branches from their mean
};

/// A network whose bonds relax alike seen from one contact sphere (docs/theory.md): the
/// viscous state of all bonds is held on that of the equilibrium under a fictitious displacement w
/// of the contact, and one linear mode q more for each direction. Each branch has a w and a q of
/// its own (CondensedBranches).
class CondensedContact final : public ContactModel {
 public:
  /// Of a fit found by build_condensed().
  /// Throws Error(bad_input) unless relaxation times and shares are above 0.
  CondensedContact(std::shared_ptr<const CondensedFit> fit, std::vector<CondensedBranch> branches,
                   double period_s);

  /// The same tissue and range with one branch or with others, at rest; nothing is balanced anew.
  /// Throws Error(bad_input) unless above 0.
  [[nodiscard]] CondensedContact with_relaxation_time(double relaxation_time_s) const;
  [[nodiscard]] CondensedContact with_branches(std::vector<CondensedBranch> branches) const;
  [[nodiscard]] CondensedContact with_period(double period_s) const;

  void reset() noexcept override;
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override;
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override;
  [[nodiscard]] Eigen::Index spheres() const noexcept override;
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override;

  [[nodiscard]] const std::vector<CondensedBranch>& branches() const noexcept { return branches_; }
  [[nodiscard]] CondensedViscousState viscous_state() const noexcept;
  /// Energy stored with the contact at a displacement and a viscous state, J: the force of step()
  /// is minus its gradient by the displacement.
  [[nodiscard]] double stored_energy_J(const Eigen::Vector3d& displacement_m,
                                       const CondensedViscousState& viscous) const noexcept;
  /// Force on what is in contact, N, with a viscous state.
  [[nodiscard]] Eigen::Vector3d force_N(const Eigen::Vector3d& displacement_m,
                                        const CondensedViscousState& viscous) const noexcept;
  /// Within a step the contact moves straight, and the viscous state relaxes while it is at this
  /// share of the way (docs/theory.md), 0.5 to 1.
  [[nodiscard]] double relaxation_point() const noexcept {
    return several() ? of_branches_->relaxation_point() : rates_.relaxation_point;
  }
  /// Number of steps since reset() in which the viscous state was kept because the computed update
  /// would have increased the energy.
  [[nodiscard]] long long kept_viscous_states() const noexcept { return kept_; }

 private:
  void set_rates(double relaxation_time_s);
  [[nodiscard]] bool several() const noexcept { return branches_.size() > 1; }
  [[nodiscard]] CondensedPull pull_of(const Eigen::Vector3d& displacement_m,
                                      const CondensedViscousState& viscous) const noexcept;

  std::shared_ptr<const CondensedFit> fit_;
  std::vector<CondensedBranch> branches_;
  double period_s_;
  CondensedRates rates_;                          ///< of one branch
  std::optional<CondensedBranches> of_branches_;  ///< of several
  CondensedState state_;
  long long kept_ = 0;
};

/// Balances the network at some 150 places and fits.
/// @param bonds, rest, constraints of the network; tools are not supported
/// @param contact from 0; it is fixed, whatever `constraints` say of it
/// @param into_tissue unit vector
/// Throws Error(bad_input) for options out of range, a contact that does not exist or tools, bonds
/// that do not relax alike or do not relax, and branches on a kernel;
/// Error(numerical) where the tissue buckles within the range.
[[nodiscard]] CondensedContact build_condensed(const BondSystem& bonds, const Positions& rest,
                                               const Constraints& constraints, std::size_t contact,
                                               const Eigen::Vector3d& into_tissue,
                                               const CondensedOptions& options = {});

}  // namespace tpm::contact
