#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/contact/law_contact.hpp"
#include "tpm/contact/stored_energy.hpp"

namespace tpm::contact {

/// A law in the loop and what it stores.
struct LawInLoop {
  LawInLoop(const LawFile& law, const LawContactSettings& settings)
      : file(law), contact(law, settings), energy(law) {}

  LawFile file;
  LawContact contact;
  StoredEnergy energy;

  /// Stored in the present state, J.
  [[nodiscard]] double stored_J() const;
  /// Force on the tool in the present state, N; 0 where the surface is not pushed in.
  [[nodiscard]] double force_N() const;
};

/// Effect of putting one law in the place of another.
struct HandOver {
  bool possible = false;
  double depth_m = 0.0, force_N = 0.0;
  double relaxed_kernel_m = 0.0;  ///< state of every branch of the new law
  double energy_before_J = 0.0, energy_after_J = 0.0;
};

/// Puts a law in the place of another in the loop, the force on the hand unchanged and no more
/// energy stored than before. Among the states of the new law that answer with the same force at
/// the same depth the one with all branches relaxed to one kernel displacement v,
///
///     v = V(u) - (F - k_inf V(u) - k_tension T(u)) / sum k_i,
///
/// stores the least energy (Lagrange: every branch has k_i (u_v - u) = lambda k_i). If that is more
/// than the old law stores, the hand-over has to wait. At zero force and depth 0 the new law is at
/// rest, which is always possible. An elastic law has no state: it waits until it answers with the
/// same force.
[[nodiscard]] HandOver consider_hand_over(const LawInLoop& from, const LawInLoop& to);

/// Carries out a possible hand-over; the new law then stands where the old one stood.
void hand_over(const HandOver& decision, LawInLoop& to) noexcept;

}  // namespace tpm::contact
