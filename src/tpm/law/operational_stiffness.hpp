#pragma once
#include <Eigen/Core>
#include <complex>
#include <span>
#include <vector>

#include "tpm/law/law.hpp"

namespace tpm {

/// A complex stiffness and its derivatives by the parameters of a law.
struct ComplexStiffness {
  std::complex<double> value;
  Eigen::RowVectorXcd by;
};

/// The operational stiffness s L[G](s) of a law, without kernel and tension: at s = i omega the
/// storage and loss of small oscillations, over s the Laplace transform of G, and 1/(s ...) that of
/// the creep compliance J.
class OperationalStiffness {
 public:
  /// @param values all of law_parameters(spec), in range; they must outlive this
  OperationalStiffness(const LawSpec& spec, std::span<const double> values);

  /// @param log_s ln s, with Im between -pi and pi
  [[nodiscard]] ComplexStiffness at(std::complex<double> log_s) const;

 private:
  [[nodiscard]] ComplexStiffness branches(std::complex<double> s) const;
  [[nodiscard]] ComplexStiffness fractional(std::complex<double> log_s) const;

  LawSpec spec_;
  std::span<const double> values_;
  std::vector<double> chain_;      ///< k_inf, k_i, tau_i of a Kelvin chain
  Eigen::MatrixXcd chain_slopes_;  ///< of these by k0, kc_i, T_i
};

}  // namespace tpm
