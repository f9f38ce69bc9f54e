#include "tpm/plan/rest_answers.hpp"

namespace tpm::plan {

const ContactSpectrum& spectrum_at_rest(const PlanScene& scene) {
  RestAnswers& answers = scene.at_rest();
  std::call_once(answers.spectrum_once, [&] { answers.spectrum = contact_spectrum(scene); });
  return *answers.spectrum;
}

const InertiaModes& modes_at_rest(const PlanScene& scene) {
  RestAnswers& answers = scene.at_rest();
  std::call_once(answers.modes_once, [&] { answers.modes = inertia_modes(scene); });
  return *answers.modes;
}

}  // namespace tpm::plan
