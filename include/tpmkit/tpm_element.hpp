#pragma once
#include <array>
#include <string_view>

#include "tpmkit/bond_element.hpp"
#include "tpmkit/units.hpp"

namespace tpm {

/// The three-parameter viscoelastic element with tension (TPM): a spring E2 in series with a
/// Kelvin-Voigt unit (E1 parallel to the dashpot eta1), and beside it the pull of two neighbour
/// bonds of modulus E' whose far ends stand at the spacing x (Bao et al. 2013, Eqs. 1-9).
///
///     e = e1 + e2,   s_h = E2 (e - e1),   eta1 de1/dt = E2 e - (E1 + E2) e1
///     s_f = lambda1(e) e,   lambda1(e) = 2 E' (1 - cos(arctan(e / x)))
///     F = (s_h + s_f) A0 / l0
///
/// The paper uses the displacement in mm as if it were a strain, that is a reference length
/// l0 = 1 mm, and turns stress into force with the area A0 = 3.14 (2 mm)^2 = 12.56 mm^2. Both are
/// parameters here. All values SI. The element is the bond element with Einf = P2 and one linear
/// branch of modulus g and relaxation time tau.
struct TpmParameters {
  double E1_Pa = 12e3;       ///< spring of the Kelvin-Voigt unit, >= 0
  double E2_Pa = 12e3;       ///< series spring, >= 0, E1 + E2 > 0
  double Eprime_Pa = 12e3;   ///< modulus E' of the lateral bonds, >= 0
  double eta1_Pa_s = 5.0;    ///< dashpot, > 0
  double spacing_m = 0.030;  ///< centre-to-centre distance x of lateral neighbours, > 0
  double A0_m2 = 12.56e-6;   ///< area that turns stress into force, > 0
  double l0_m = 1e-3;        ///< reference length that turns displacement into strain, > 0

  /// tau = eta1 / (E1 + E2), s: decay time of the force at constant elongation.
  [[nodiscard]] double relaxation_time_s() const { return eta1_Pa_s / (E1_Pa + E2_Pa); }
  /// The same springs with another relaxation time.
  [[nodiscard]] TpmParameters with_relaxation_time(double time_s) const {
    TpmParameters other = *this;
    other.eta1_Pa_s = time_s * (E1_Pa + E2_Pa);
    return other;
  }
  /// P2 = E1 E2 / (E1 + E2), Pa: modulus after full relaxation, without tension.
  [[nodiscard]] double equilibrium_modulus_Pa() const { return E1_Pa * E2_Pa / (E1_Pa + E2_Pa); }
  /// g = E2^2 / (E1 + E2), Pa: the part of E2 that relaxes; E2 = P2 + g.
  [[nodiscard]] double relaxing_modulus_Pa() const { return E2_Pa * E2_Pa / (E1_Pa + E2_Pa); }
  /// A0 / l0, m: turns a modulus into a stiffness.
  [[nodiscard]] double modulus_to_stiffness_m() const { return A0_m2 / l0_m; }

  [[nodiscard]] BondElement bonds(LateralBond lateral = LateralBond::elastic) const;
  // NOLINTNEXTLINE(google-explicit-constructor): it is one, stated by other constants
  operator BondElement() const { return bonds(); }
};

/// Name, dimension and meaning of a parameter of a vector.
struct ParameterDescription {
  std::string_view name;
  Dimension dimension;
  std::string_view meaning;
};

enum TpmIndex : int { kE1, kE2, kEprime, kEta1, kSpacing, kA0, kL0, kTpmParameterCount };

inline constexpr std::array<ParameterDescription, kTpmParameterCount> kTpmParameterTable{{
    {"E1", Dimension::stress, "spring of the Kelvin-Voigt unit"},
    {"E2", Dimension::stress, "series spring"},
    {"Eprime", Dimension::stress, "modulus of the lateral bonds"},
    {"eta1", Dimension::viscosity, "dashpot"},
    {"spacing", Dimension::length, "distance x of lateral neighbours, centre to centre"},
    {"A0", Dimension::area, "area that turns stress into force"},
    {"l0", Dimension::length, "length that turns displacement into strain"},
}};

using TpmVector = std::array<double, kTpmParameterCount>;

[[nodiscard]] TpmVector to_vector(const TpmParameters& p);
[[nodiscard]] TpmParameters from_vector(const TpmVector& v);

/// The constants of a bond element with one linear branch, as to_vector(). Throws Error(bad_input)
/// for other elements, including elastic ones.
[[nodiscard]] TpmVector element_constants(const BondElement& element);

/// Throws Error(bad_input) naming the first parameter outside the range given at TpmParameters.
void require_valid(const TpmParameters& p, std::string_view where);

/// Force at a time after a step of depth, N (Eq. 11; at t = 0+ Eq. 15, at t -> infinity Eq. 16).
/// @param lambda1 Pa, constant as in the paper
[[nodiscard]] double step_relaxation_force_N(const TpmParameters& p, double lambda1, double depth_m,
                                             double time_s);

/// Eq. 14: the depth under a constant load with constant lambda1, m. time_s may be infinite.
[[nodiscard]] double creep_depth_m(const TpmParameters& p, double lambda1, double load_N,
                                   double time_s);

}  // namespace tpm
