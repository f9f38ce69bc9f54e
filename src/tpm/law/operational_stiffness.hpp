#pragma once
#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "tpmkit/law.hpp"

namespace tpm::law {

/// A complex stiffness and its derivatives by the parameters of a law.
struct ComplexStiffness {
  std::complex<double> value;
  Eigen::RowVectorXcd by;
};

/// 1/z by real divisions (Smith 1962). The complex division of the language looks after infinite
/// parts, which costs several times as much.
[[nodiscard]] inline std::complex<double> reciprocal(std::complex<double> z) {
  const double x = z.real();
  const double y = z.imag();
  if (std::abs(x) >= std::abs(y)) {
    const double ratio = y / x;
    const double part = 1.0 / (x + y * ratio);
    return {part, -ratio * part};
  }
  const double ratio = x / y;
  const double part = 1.0 / (x * ratio + y);
  return {ratio * part, -part};
}

/// The operational stiffness s L[G](s) of a law, without kernel and tension: at s = i omega the
/// storage and loss of small oscillations, over s the Laplace transform of G, and 1/(s ...) that of
/// the creep compliance J.
class OperationalStiffness {
 public:
  /// @param values all of law_parameters(spec), in range; they must outlive this
  OperationalStiffness(const LawSpec& spec, std::span<const double> values);

  /// @param log_s ln s, with Im between -pi and pi
  [[nodiscard]] ComplexStiffness at(std::complex<double> log_s) const;

  /// Powers of s that a fractional law consists of: s^alpha and s^beta of spring-pots side by side,
  /// (s tau)^(alpha - beta) and (s tau)^beta of two in series.
  struct Powers {
    std::complex<double> log;  ///< ln s, or ln(s tau)
    std::complex<double> first, second;
  };
  /// @param log_s ln s
  [[nodiscard]] Powers powers(std::complex<double> log_s) const;
  /// The powers at s/t from those at s, without another complex exponential.
  class PowersOverTime {
   public:
    PowersOverTime(const OperationalStiffness& of, double log_t);
    [[nodiscard]] Powers operator()(const Powers& at_s) const;

   private:
    double log_t_, first_, second_;
  };
  /// As at() of a fractional law. Allocates only if `out` has another size.
  void fractional(const Powers& powers, ComplexStiffness& out) const;

  /// The instantaneous stiffness of a fractional law (s = infinity): nothing where a
  /// spring-pot stands in no spring's series, which is then infinitely stiff. The orders have no
  /// part in it: their derivatives are 0.
  [[nodiscard]] std::optional<ComplexStiffness> instant() const;

 private:
  [[nodiscard]] ComplexStiffness branches(std::complex<double> s) const;

  /// Exponents of the two powers, and what is added to ln s.
  struct Exponents {
    double first = 0.0, second = 0.0, log_tau = 0.0;
  };
  [[nodiscard]] Exponents exponents() const;

  LawSpec spec_;
  std::span<const double> values_;
  Exponents exponents_;
  std::vector<double> chain_;      ///< k_inf, k_i, tau_i of a Kelvin chain
  Eigen::MatrixXcd chain_slopes_;  ///< of these by k0, kc_i, T_i
};

}  // namespace tpm::law
