#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "tpmkit/law.hpp"
#include "tpmkit/model.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm {

/// Response to small oscillations: K*(i omega) = storage + i loss at each frequency, with the
/// derivatives by all parameters. N/m, or Pa for a stretched strip and for the paper's element.
struct SpectrumResponse {
  Eigen::VectorXd storage;  ///< size n_frequencies
  Eigen::VectorXd loss;
  RowMatrix storage_by;  ///< n_frequencies x n_parameters; 0 x 0 unless asked for
  RowMatrix loss_by;

  /// |eta*| = |K*|/omega, N s/m (or Pa s).
  [[nodiscard]] Eigen::VectorXd complex_viscosity(std::span<const double> frequency_Hz) const;
  /// tan delta = loss/storage; infinite where nothing is stored.
  [[nodiscard]] Eigen::VectorXd loss_tangent() const;
};

/// Response of a law to small oscillations about the equilibrium at a depth u_b of the tissue:
///
///     K* = V'(u_b) G*(i omega) + k_tension T'(u_b),   G* = i omega times the transform of G
///        = k_inf + sum_i k_i i omega tau_i/(1 + i omega tau_i)          (branches)
///        = k_inf + k1 (i omega 1 s)^alpha                               (spring-pot)
///        = k_inf + k1 (i omega tau1)^alpha/(1 + (i omega tau1)^alpha)   (E_alpha)
///
/// (Tschoegl 1989; Mainardi 2010 for the fractional laws). V and T as at LawSpec. `contact` and
/// `offset` belong to a recording over time: their derivatives are 0.
/// @param parameters    all of law_parameters(spec), in range
/// @param frequency_Hz  each > 0
/// @param operating_depth u_b >= 0, m or relative length; none: the reference. Without meaning for
///                      a linear kernel without tension.
/// Throws Error(bad_input).
[[nodiscard]] SpectrumResponse respond_spectrum(const LawSpec& spec,
                                                std::span<const double> parameters,
                                                std::span<const double> frequency_Hz,
                                                std::optional<double> operating_depth, Want want);

/// The same for the paper's element about its undeformed state, where its tension has no stiffness:
/// E* = E2 - E2^2/(E1 + E2 + i omega eta1), Pa. Parameters in the order of TpmIndex.
/// Throws Error(bad_input).
[[nodiscard]] SpectrumResponse element_spectrum(const TpmVector& parameters,
                                                std::span<const double> frequency_Hz, Want want);

}  // namespace tpm
