#pragma once
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/element_contact.hpp"
#include "tpm/haptics/device/virtual_plant.hpp"

namespace tpm::haptics {

/// A linear contact as it is rendered: an element without tension, at rest.
struct RenderedContact {
  ElementRule rule = ElementRule::exact;
  double period_s = 1e-3;
  int delay_periods = 0;             ///< from a command to its force
  double relaxation_time_s = 0.01;   ///< of no meaning for the mass-spring model
  double stiffness_N_per_m = 300.0;  ///< instantaneous
  double equilibrium_share = 0.5;  ///< of it in equilibrium, all there is of the MSM; E1 = E2: 1/2

  [[nodiscard]] BondElement material() const;
  /// Dashpot of the mass-spring model: damping ratio 0.1 of a sphere of 10 mm radius.
  [[nodiscard]] double dashpot_N_s_per_m() const;
  [[nodiscard]] ElementContact model() const;
};

// --- passivity: safe with every passive operator ------------------------------------------------

/// Friction that a device needs for the contact to be passive, N s/m, measured: the contact is
/// moved in sinusoids up to the Nyquist frequency, straight between samples, which is the motion in
/// which friction takes least; the force is constant. Infinite if the rendering diverges.
[[nodiscard]] double measured_passive_damping(const RenderedContact& contact);

/// The same by the condition of Colgate and Schenkel (1997) with the discrete transfer function of
/// the rule, b > T max Re[(1 - 1/z) H(z) z^-delay] / (2 (1 - cos)), over a fine grid of
/// frequencies.
[[nodiscard]] double predicted_passive_damping(const RenderedContact& contact);

/// Method that finds a boundary, one of two.
enum class BoundaryBy { measurement, prediction };

/// Largest instantaneous stiffness that is passive on a device with that friction, N/m, by
/// bisection.
[[nodiscard]] double largest_passive_stiffness(RenderedContact contact, double damping_N_s_per_m,
                                               BoundaryBy by);

/// Smallest relaxation time that is passive on a device with that friction, s, by bisection between
/// a thousandth and a thousand periods; 0 if all of them are, infinite if none is.
[[nodiscard]] double smallest_passive_relaxation_time(RenderedContact contact,
                                                      double damping_N_s_per_m, BoundaryBy by);

// --- stability: of one device and one operator --------------------------------------------------

/// Largest modulus of the eigenvalues of the loop of device, arm and contact over a period.
[[nodiscard]] double loop_spectral_radius(const RenderedContact& contact,
                                          const PlantSettings& plant);

/// Largest instantaneous stiffness at which device, arm and contact come to rest, N/m, by
/// bisection: on the simulated device, or by the spectral radius.
[[nodiscard]] double largest_stable_stiffness(RenderedContact contact, const PlantSettings& plant,
                                              BoundaryBy by);

}  // namespace tpm::haptics
