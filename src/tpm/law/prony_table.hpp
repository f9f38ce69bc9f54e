#pragma once
#include <span>
#include <vector>

#include "tpmkit/law.hpp"

namespace tpm::law {

/// A relaxation function as other programs take it: G(t) = instant (long_share + sum_i g_i
/// exp(-t/tau_i)) with long_share + sum g_i = 1.
struct PronyTable {
  double instant = 0.0;       ///< G(0) of the table, N/m (or Pa)
  double long_share = 0.0;    ///< equilibrium share, 0 to 1
  std::vector<double> g;      ///< > 0
  std::vector<double> tau_s;  ///< rising
  bool fitted = false;        ///< a fractional law: the table follows it within the window only
  double from_s = 0.0;        ///< the window, if fitted
  double to_s = 0.0;
  double worst_relative_error = 0.0;  ///< of G over the window, if fitted

  [[nodiscard]] double at(double t_s) const;
};

/// Window and times by which a fractional law is turned into branches.
struct PronyWindow {
  double from_s = 0.01;
  double to_s = 100.0;
  int times = 0;  ///< relaxation times to choose from; 0: two in a decade, and one
};

/// G(t) of a law at t >= 0 (spring-pots: t > 0), without kernel and tension, N/m (or Pa).
/// @param values all of law_parameters(spec), in range
[[nodiscard]] double relaxation_stiffness(const LawSpec& spec, std::span<const double> values,
                                          double t_s);

/// The table of a law: exact for branches (a Kelvin chain is converted); for a fractional law the
/// non-negative least squares fit of log-spaced relaxation times to G over the window, in relative
/// terms, with the largest error stated. Branches without stiffness are left out.
/// Throws Error(bad_input) for a window that is none, more than 50 times, or a law without
/// stiffness.
[[nodiscard]] PronyTable prony_table(const LawSpec& spec, std::span<const double> values,
                                     const PronyWindow& window);

}  // namespace tpm::law
