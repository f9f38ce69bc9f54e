#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/law/contact_geometry.hpp"

namespace tpm::fit {

/// Young's modulus of one stiffness of a fitted law, with its interval. SI.
struct YoungModulus {
  std::string name;  ///< "E_inf", "E1", "E_instantaneous"
  std::string of;    ///< the parameter, or the sum, that it stands for
  std::string unit;  ///< "Pa", of a spring-pot "Pa s^alpha", its stiffness at 1 s
  double estimate = 0.0;
  std::optional<double> standard_error, lower, upper;  ///< none: not known, or open
  std::string basis;  ///< "profile", "pooled", or "linearised" for sums
  std::string verdict;
};

/// E of every stiffness of a fitted law, and of all of them together, which is what resists at
/// once.
struct YoungModuli {
  std::string geometry;  ///< geometry_words()
  double poisson_ratio = 0.0;
  bool poisson_assumed = true;
  double level = 0.95;
  double reference_m = 0.0;  ///< depth at which the stiffnesses are secants
  std::vector<YoungModulus> moduli;
  std::vector<Remark> remarks;
};

/// E is a constant times the stiffness, so limits of profiles carry over as they are.
/// Throws Error(bad_input) for a law of stress, whose stiffnesses are moduli already.
[[nodiscard]] YoungModuli young_moduli(const FitResult& fit, const ContactGeometry& geometry,
                                       bool poisson_assumed);

/// Those of the typical specimen of a folder: the pooled stiffnesses and the limits of their
/// intervals times the same constant. Their sum is pooled by the logarithm of each specimen's.
[[nodiscard]] YoungModuli pooled_moduli(const SpecimenStudy& study, const ContactGeometry& geometry,
                                        bool poisson_assumed);

[[nodiscard]] Json to_json(const YoungModuli& moduli);
[[nodiscard]] std::string to_terminal_text(const YoungModuli& moduli);

/// The laws of a family whose kernel is that of the probe. A cone has the power kernel, whose
/// exponent is then fixed: probe_exponent().
[[nodiscard]] std::vector<LawSpec> laws_of_probe(const std::vector<LawSpec>& laws,
                                                 const ContactGeometry& geometry);
[[nodiscard]] std::optional<double> probe_exponent(const ContactGeometry& geometry);

}  // namespace tpm::fit
