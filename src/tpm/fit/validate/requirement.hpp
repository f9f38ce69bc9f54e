#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpmkit/units.hpp"

namespace tpm::fit {

/// Largest model error allowed: stated by the user before the comparison.
struct Requirement {
  bool share = true;                               ///< of the measured value; else an amount
  double value = 0.0;                              ///< > 0: a share, or SI
  Dimension dimension = Dimension::dimensionless;  ///< of an amount
  bool of_force = false;                           ///< of forces alone: what a hand can tell
  std::string stated;                              ///< as typed, with what jnd stands for
};

/// "10%", "0.1", "20 mN", or "jnd" (the just noticeable difference of force that tpm plan uses).
/// Throws Error(bad_input).
[[nodiscard]] Requirement parse_requirement(std::string_view text, std::string_view where);

/// Verdict on a model error delta, known to be in [E - U, E + U].
enum class ModelVerdict {
  no_requirement,  ///< none in the unit of the quantity
  adequate,        ///< |E| + U <= R
  not_adequate,    ///< |E| - U > R
  undetermined,    ///< neither, or a part of the uncertainty is not known
  not_seen,        ///< no requirement, |E| <= U
  seen,            ///< no requirement, |E| > U
  residual,        ///< the data were fitted: no verdict
};
/// "adequate", "not adequate", "no model error is seen above the uncertainty", ...
[[nodiscard]] std::string_view verdict_words(ModelVerdict verdict) noexcept;
/// The word in files: "adequate", "not_adequate", "not_seen", ...
[[nodiscard]] std::string_view verdict_key(ModelVerdict verdict) noexcept;

/// A standard uncertainty that belongs to one source.
struct UncertaintyPart {
  std::string name;  ///< "the zero of the force"
  double u = 0.0;    ///< SI of the quantity
};

/// E, u_val and what follows from them.
struct ErrorWithUncertainty {
  double error = 0.0;     ///< E = S - D
  double u_val = 0.0;     ///< standard uncertainty of E
  double degrees = 0.0;   ///< effective, of u_val (Welch-Satterthwaite); may be infinite
  double coverage = 2.0;  ///< k: Student's quantile of 95 %
  [[nodiscard]] double expanded() const { return coverage * u_val; }  ///< U
};

/// Adds a variance of so many degrees of freedom (infinite: known).
class CombinedUncertainty {
 public:
  void add(double u, double degrees);
  /// u^2 is the difference of a variance `whole`^2 with these degrees of freedom and a known one:
  /// its own uncertainty is that of the whole, also where the difference is 0.
  void add_difference(double u, double whole, double degrees);
  [[nodiscard]] double u() const;
  /// u^4 / sum (u_i^4 / nu_i), at least 1; of a difference whole^4 / nu.
  [[nodiscard]] double degrees() const;
  /// A difference whose whole is so large beside u that the formula gives less than one degree of
  /// freedom: no coverage factor says what u is then.
  [[nodiscard]] bool untold() const;

 private:
  double square_ = 0.0, fourth_over_degrees_ = 0.0;
};

/// Student's two-sided quantile of 95 %; normal for infinite degrees.
[[nodiscard]] double coverage_factor(double degrees);

/// @param limit R in the unit of the quantity; none: no requirement
[[nodiscard]] ModelVerdict judge_error(const ErrorWithUncertainty& e, std::optional<double> limit);

/// Probability of an |E| this far beyond R (or beyond 0) if |delta| is R (or 0), two-sided.
[[nodiscard]] double error_p_value(const ErrorWithUncertainty& e, std::optional<double> limit);

/// Holm's step-down procedure (Scand. J. Stat. 6 (1979) 65): which of several hypotheses are
/// rejected at the level.
[[nodiscard]] std::vector<bool> holm_rejects(const std::vector<double>& p_values,
                                             double level = 0.05);

/// Of an undetermined error: which part of u_val must shrink, and to what, for a verdict:
/// "the zero of the force from 18.1 mN to 5.2 mN". The largest part first; others follow where it
/// alone does not do. Empty if no uncertainty at all would decide (|E| = R).
/// @param unit in which numbers are shown
[[nodiscard]] std::string what_must_shrink(const ErrorWithUncertainty& e, double limit,
                                           std::vector<UncertaintyPart> parts, const Unit& unit);

/// Code of the remark that says which part of u_val must shrink.
inline constexpr const char* kMustShrink = "must_shrink";
/// what_must_shrink() as a remark; none where it is empty.
[[nodiscard]] std::optional<Remark> shrink_remark(const ErrorWithUncertainty& e, double limit,
                                                  std::vector<UncertaintyPart> parts,
                                                  const Unit& unit);

}  // namespace tpm::fit
