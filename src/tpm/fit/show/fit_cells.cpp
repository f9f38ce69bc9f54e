#include "tpm/fit/show/fit_cells.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/text.hpp"

namespace tpm::fit {

Tone tone_of(const ParameterResult& p) {
  if (p.not_separable || p.unconfirmed) return Tone::bad;
  switch (p.verdict) {
    case Verdict::identified:
      return Tone::good;
    case Verdict::lower_only:
    case Verdict::upper_only:
      return Tone::fair;
    case Verdict::flat:
    case Verdict::failed:
      return Tone::bad;
    case Verdict::not_profiled:
      break;
  }
  return Tone::plain;
}

Tone tone_of_residual(double standardised) {
  const double size = std::abs(standardised);
  return size > 3.0 ? Tone::bad : size > 2.0 ? Tone::fair : Tone::plain;
}

std::string observed(const FitDatum& d) {
  const auto& [symbol, dimension, unit] = shown_unit(quantity_dimension(d.quantity));
  if (d.value) return fmt::format("{} {}", significant(*d.value / unit, 4), symbol);
  return fmt::format("{} to {} {}", significant(*d.lower / unit, 3),
                     significant(*d.upper / unit, 3), symbol);
}

std::string predicted(const FittedDatum& d, bool with_sd) {
  const auto& [symbol, dimension, unit] = shown_unit(quantity_dimension(d.datum.quantity));
  if (with_sd && d.predicted_sd) {
    return fmt::format("{} ± {} {}", significant(d.predicted / unit, 4),
                       significant(*d.predicted_sd / unit, 2), symbol);
  }
  return fmt::format("{} {}", significant(d.predicted / unit, 4), symbol);
}

}  // namespace tpm::fit
