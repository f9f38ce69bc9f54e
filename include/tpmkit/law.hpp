#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/curve.hpp"
#include "tpmkit/units.hpp"

namespace tpm {

/// Growth of the elastic force of a contact with its depth u, relative to a reference depth u_ref.
enum class Kernel {
  linear,  ///< W = u (the paper; a flat punch; a stretched strip)
  hertz,   ///< W = u_ref (u/u_ref)^(3/2): rigid sphere on a half space. Lee and Radok's solution
           ///< while the contact grows, Ting's while it shrinks
  power,   ///< W = u_ref (u/u_ref)^m, 1 <= m: quasi-linear viscoelasticity after Fung
};

/// Parameters that describe the relaxing branches: two views of one law.
enum class BranchForm {
  parallel,  ///< generalised Maxwell (Prony): k_inf, k_i, tau_i
  series,    ///< Kelvin chain: k0 in series with units of a spring kc_i and a retardation time T_i
};

/// The pull of the neighbour bonds, T(u) = u phi(u)/phi(u_ref), phi = 1 - cos(arctan(u/x)) (Eq. 2);
/// with x infinite T = u (u/u_ref)^2.
enum class Tension {
  none,
  elastic,   ///< F += k_tension T(u), which does not relax (the paper)
  relaxing,  ///< the kernel is (1 - tension_share) W + tension_share T and relaxes as a whole
};

/// Relaxation by spring-pots instead of by branches. A spring-pot of the order alpha has the
/// operational stiffness k (s tau)^alpha: a spring at 0, a dashpot at 1.
enum class Fractional {
  none,
  springpot,     ///< G = k1 (t/1s)^-alpha / Gamma(1-alpha)
  maxwell,       ///< spring k1 in series with a spring-pot: G = k1 E_alpha(-(t/tau1)^alpha)
  kelvin_voigt,  ///< spring k_inf beside a spring-pot: G = k_inf + k1 (t/1s)^-alpha/Gamma(1-alpha)
  zener,         ///< G = k_inf + k1 E_alpha(-(t/tau1)^alpha)
  /// Two spring-pots in series, with d = alpha - beta:
  /// G = k1 (t/tau1)^-beta E_{d,1-beta}(-(t/tau1)^d)
  maxwell_pair,
  /// Two spring-pots side by side:
  /// G = k1 (t/1s)^-alpha/Gamma(1-alpha) + k2 (t/1s)^-beta/Gamma(1-beta)
  kelvin_voigt_pair,
  zener_pair,  ///< spring k_inf beside maxwell_pair
};

/// True if a law has two spring-pots. They may change places without changing the law: alpha is
/// the larger order by convention only.
[[nodiscard]] constexpr bool has_two_springpots(Fractional law) {
  return law == Fractional::maxwell_pair || law == Fractional::kelvin_voigt_pair ||
         law == Fractional::zener_pair;
}
/// True if a spring k_inf is parallel to the relaxing part.
[[nodiscard]] constexpr bool has_lasting_spring(Fractional law) {
  return law == Fractional::kelvin_voigt || law == Fractional::zener ||
         law == Fractional::zener_pair;
}
/// True if the law has a relaxation time, as series combinations do.
[[nodiscard]] constexpr bool has_relaxation_time(Fractional law) {
  return law == Fractional::maxwell || law == Fractional::zener ||
         law == Fractional::maxwell_pair || law == Fractional::zener_pair;
}

/// The most branches of a law.
inline constexpr int kMostBranches = 40;

/// One member of the family of laws (docs/theory.md):
///
///     F(t) = offset + integral G(t - s) dV(u(s)) + k_tension T(u(t)),   u = max(drive - contact,
///     0) G(t) = k_inf + sum_i k_i exp(-t/tau_i)     (or a fractional G)
///
/// The drive is an indentation depth (response: a contact force) or a relative length (response: a
/// stress). `contact` is the depth at which contact begins, or the slack length; `offset` the zero
/// error of the response.
struct LawSpec {
  Kernel kernel = Kernel::linear;
  int branches = 1;  ///< 0 to kMostBranches; 0 if fractional
  BranchForm form = BranchForm::parallel;
  bool solid = true;  ///< false: no k_inf, everything relaxes (only with branches, parallel form)
  Tension tension = Tension::none;
  Fractional fractional = Fractional::none;
  Quantity drive = Quantity::indentation_depth;  ///< or strain, relative_length
  Quantity response = Quantity::contact_force;   ///< or stress
  double reference = 1e-3;  ///< u_ref > 0: m, or dimensionless for strain and relative_length

  bool operator==(const LawSpec&) const = default;
};

/// "linear", "linear-1", "linear-1-elastic", "power-2", "hertz-fzener", "linear-2-fluid",
/// "linear-1-series": kernel, then branches or fspringpot/fmaxwell/fkelvin_voigt/fzener, with
/// two spring-pots fmaxwell2/fkelvin_voigt2/fzener2, then elastic/relaxing, then fluid, then
/// series. Units and reference are not part of it.
[[nodiscard]] std::string law_name(const LawSpec& spec);

/// The inverse of law_name; drive, response and reference keep their defaults. Throws
/// Error(bad_input).
[[nodiscard]] LawSpec parse_law_name(std::string_view text, std::string_view where);

/// True if the coefficients are secants at the reference depth, because kernel or tension is
/// nonlinear. Such coefficients can be compared only at one reference.
[[nodiscard]] bool depends_on_reference(const LawSpec& spec) noexcept;

/// "coefficients are secants at a depth of 4 mm"; empty if they do not depend on it.
[[nodiscard]] std::string reference_words(const LawSpec& spec);

/// A sentence: "power-law kernel, two relaxing branches, no tension".
[[nodiscard]] std::string law_words(const LawSpec& spec);

/// Throws Error(bad_input) if the parts of the law contradict each other.
void require_valid(const LawSpec& spec, std::string_view where);

/// One parameter of a law.
struct LawParameter {
  std::string name;     ///< k_inf, k1, tau1, k0, kc1, T1, alpha, exponent, k_tension, ...
  Dimension dimension;  ///< stiffness (N/m), or stress for a stretched strip
  std::string meaning;
  bool linear = false;           ///< the response is linear in it (the others fixed)
  bool nuisance = false;         ///< belongs to the recording, not to the material
  std::optional<double> preset;  ///< value if nobody sets it
  double lower = 0.0;            ///< smallest and largest physical value
  double upper = 0.0;
};

/// In the order of the parameter vector: k_inf (or k0), k_i (kc_i), tau_i (T_i), alpha, beta,
/// exponent, k_tension or tension_share, spacing, then the nuisance parameters contact and offset,
/// always.
[[nodiscard]] std::vector<LawParameter> law_parameters(const LawSpec& spec);

/// Relaxation function of a law in parallel form: G(t) = k_inf + sum k_i exp(-t/tau_i).
struct Prony {
  double k_inf = 0.0;
  std::vector<double> k;      ///< N/m (or Pa), >= 0
  std::vector<double> tau_s;  ///< > 0
};

/// A Kelvin chain: J(t) = 1/k0 + sum (1/k_i)(1 - exp(-t/T_i)) [+ t/eta if fluid].
struct KelvinChain {
  double k0 = 0.0;
  std::vector<double> k;    ///< springs of the units, > 0
  std::vector<double> T_s;  ///< retardation times, rising
  double eta = 0.0;         ///< dashpot in series of a fluid; 0 for a solid
};

/// Exact conversions (roots of the partial fractions, which interlace). Branches with k = 0 vanish
/// and equal times merge. Throws Error(bad_input) for negative coefficients or a law that cannot
/// be written so (no stiffness at all).
[[nodiscard]] KelvinChain to_series(const Prony& law);
[[nodiscard]] Prony to_parallel(const KelvinChain& chain);

}  // namespace tpm
