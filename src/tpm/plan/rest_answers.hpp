#pragma once
#include <mutex>
#include <optional>

#include "tpm/plan/contact_spectrum.hpp"
#include "tpm/plan/inertia_estimate.hpp"

namespace tpm::plan {

/// Answers of the linear network at rest, whatever the protocol is: found when first asked for,
/// also by several threads. What throws does so each time.
struct RestAnswers {
  std::once_flag spectrum_once, modes_once;
  std::optional<ContactSpectrum> spectrum;
  std::optional<InertiaModes> modes;
};

/// contact_spectrum, found once.
[[nodiscard]] const ContactSpectrum& spectrum_at_rest(const PlanScene& scene);
/// inertia_modes, found once.
[[nodiscard]] const InertiaModes& modes_at_rest(const PlanScene& scene);

}  // namespace tpm::plan
