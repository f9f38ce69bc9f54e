#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/likelihood/config.hpp"
#include "tpmkit/curve.hpp"
#include "tpmkit/law.hpp"
#include "tpmkit/model.hpp"

namespace tpm::fit {

/// Small oscillations of a law about a depth, and what is read of them.
struct Oscillation {
  enum class Part { storage, loss };
  struct Reading {
    std::size_t frequency;  ///< place in frequency_Hz
    Part part;
  };

  LawSpec law;
  std::vector<double> frequency_Hz;       ///< each > 0
  std::optional<double> operating_depth;  ///< m or relative length; none: the law's reference
  double law_per_reading = 1.0;           ///< the law's stiffness over the reading; m for a modulus
  std::vector<Reading> readings;
};

/// Oscillation that a spectrum asks of the law of its configuration, no reading chosen yet. A law
/// of an indentation answers a dynamic stiffness, and a modulus only with
/// DataChoice::stiffness_per_modulus_m; a law of a strip answers a modulus.
/// Throws Error(bad_input) naming the data set if there is no law, the protocol is no oscillation
/// or the law does not answer such readings.
[[nodiscard]] Oscillation oscillation_of(const FitConfig& config, const DataChoice& data,
                                         const Spectrum& spectrum);

/// The answers to the readings in their own unit (n_readings) and, if wanted, their exact
/// derivatives by all parameters of the law.
/// Throws Error(bad_input) for parameters out of range.
[[nodiscard]] Response respond(const Oscillation& oscillation, std::span<const double> parameters,
                               Want want);

/// "storage at 1.2 Hz", "loss at 1.2 Hz".
[[nodiscard]] std::string oscillation_label(Quantity quantity, double frequency_Hz);

}  // namespace tpm::fit
