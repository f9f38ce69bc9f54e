#include "tpm/fit/select/untold_noise.hpp"

#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {

bool doubt_untold_noise(FitResult& fit) {
  if (!fit.adequacy || fit.adequacy->verdict != described_name(Described::not_judged)) return false;
  if (!fit.noise || !fit.noise->correlated) return false;
  const double independent = fit.value_count / fit.noise->inflation;
  if (independent >= static_cast<double>(fit.parameters.size())) return false;
  for (ParameterResult& p : fit.parameters) {
    const bool said = p.verdict == Verdict::failed || p.verdict == Verdict::flat;
    if (said || p.unconfirmed || p.not_separable) continue;
    p.unconfirmed = Remark{"noise_not_told", "neither a rest nor the residuals tell the noise"};
    p.summary = parameter_words(p, fit.config.level);
  }
  return true;
}

}  // namespace tpm::fit
