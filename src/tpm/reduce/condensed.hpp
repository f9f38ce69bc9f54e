#pragma once
#include <Eigen/Core>
#include <memory>

#include "tpm/network/bond_system.hpp"
#include "tpm/network/freedom.hpp"
#include "tpm/reduce/condensed_tables.hpp"
#include "tpm/reduce/contact_model.hpp"

namespace tpm {

struct CondensedFit;

/// What a condensed model is built for.
struct CondensedOptions {
  double depth_m = 8e-3;       ///< of the contact along the push, > 0
  double tangential_m = 2e-3;  ///< of the contact across it, > 0
  double period_s = 1e-3;      ///< of the servo loop, > 0
};

/// What a condensed model remembers, in the axes of its contact: into the tissue and two tangents.
struct CondensedMemory {
  Eigen::Vector3d w_m = Eigen::Vector3d::Zero();  ///< fictitious displacement
  Eigen::Vector3d q_m = Eigen::Vector3d::Zero();  ///< along the second mode
};

/// A network with one relaxation time seen from one contact sphere
/// (docs/reduction.md): the memory of all bonds is held on that of the relaxed
/// equilibrium under a fictitious displacement w of the contact, and one linear mode q more for
/// each direction.
class CondensedContact final : public ContactModel {
 public:
  /// Of a fit found by build_condensed().
  CondensedContact(std::shared_ptr<const CondensedFit> fit, double relaxation_time_s,
                   double period_s);

  /// The same tissue and range, at rest; nothing is balanced anew.
  /// Throws Error(bad_input) unless above 0.
  [[nodiscard]] CondensedContact with_relaxation_time(double relaxation_time_s) const;
  [[nodiscard]] CondensedContact with_period(double period_s) const;

  void reset() noexcept override;
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override;
  [[nodiscard]] Eigen::Matrix3d relaxed_stiffness() const noexcept override;
  [[nodiscard]] Eigen::Index spheres() const noexcept override;
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override;

  [[nodiscard]] double relaxation_time_s() const noexcept { return relaxation_time_s_; }
  [[nodiscard]] CondensedMemory memory() const noexcept;
  /// Energy stored with the contact at a displacement and a memory, J: the force of step() is minus
  /// its gradient by the displacement.
  [[nodiscard]] double stored_energy_J(const Eigen::Vector3d& displacement_m,
                                       const CondensedMemory& memory) const noexcept;
  /// Force on what is in contact, N, with a memory.
  [[nodiscard]] Eigen::Vector3d force_N(const Eigen::Vector3d& displacement_m,
                                        const CondensedMemory& memory) const noexcept;
  /// Within a step the contact moves straight, and the memory relaxes while it is at this share of
  /// the way (docs/reduction.md), 0.5 to 1.
  [[nodiscard]] double resting_share() const noexcept { return rates_.resting_share; }
  /// Steps since reset() in which the memory was left as it was, for to relax it as computed would
  /// not have lowered the energy.
  [[nodiscard]] long long kept_memories() const noexcept { return kept_; }

 private:
  void set_rates();
  [[nodiscard]] CondensedValue value_of(const Eigen::Vector3d& displacement_m,
                                        const CondensedMemory& memory) const noexcept;

  std::shared_ptr<const CondensedFit> fit_;
  double relaxation_time_s_, period_s_;
  CondensedRates rates_;
  CondensedState state_;
  long long kept_ = 0;
};

/// Balances the network at some 150 places and fits.
/// @param bonds, rest, freedom of the network; tools are not supported
/// @param contact from 0; it is held here, whatever `freedom` says of it
/// @param into_tissue unit vector
/// Throws Error(bad_input) for options out of range, a contact that does not exist or tools;
/// Error(numerical) where the tissue buckles within the range.
[[nodiscard]] CondensedContact build_condensed(const BondSystem& bonds, const Positions& rest,
                                               const Freedom& freedom, std::size_t contact,
                                               const Eigen::Vector3d& into_tissue,
                                               const CondensedOptions& options = {});

}  // namespace tpm
