#include "tpm/fit/likelihood/oscillation.hpp"

#include <fmt/format.h>

#include "tpmkit/error.hpp"
#include "tpmkit/frequency_response.hpp"

namespace tpm::fit {
namespace {

/// Factor from the readings to what the law answers.
double law_per_reading(const LawSpec& law, const DataChoice& data, Dimension readings) {
  const std::string where = fmt::format("spectrum '{}'", data.dataset);
  const bool strip = is_answered_by_stress(law.drive);
  if (readings == Dimension::stiffness) {
    if (strip) {
      throw bad_input(where, "stiffnesses, and a law of stress",
                      "moduli, or a law with the drive 'indentation_depth'");
    }
    if (data.stiffness_per_modulus_m) {
      throw bad_input(where, "stiffnesses, and 'stiffness_per_modulus' in their data entry",
                      "that key only for moduli");
    }
    return 1.0;
  }
  if (strip) return 1.0;
  if (data.stiffness_per_modulus_m) return *data.stiffness_per_modulus_m;
  throw bad_input(where, "moduli, and a law of contact force over indentation depth",
                  "\"stiffness_per_modulus\": A0/l0 such as \"12.56 mm\" in its data entry, or "
                  "stiffnesses");
}

}  // namespace

Oscillation oscillation_of(const FitConfig& config, const DataChoice& data,
                           const Spectrum& spectrum) {
  if (!config.law || data.protocol.kind != ProtocolChoice::Kind::oscillation) {
    throw bad_input(fmt::format("spectrum '{}'", data.dataset),
                    "without a law or under another protocol", "a law, and protocol 'oscillation'");
  }
  const LawSpec& law = *config.law;
  return {law,
          spectrum.frequency_Hz,
          data.protocol.operating_depth,
          law_per_reading(law, data, spectrum.dimension),
          {}};
}

Response respond(const Oscillation& oscillation, std::span<const double> parameters, Want want) {
  const SpectrumResponse spectrum = respond_spectrum(
      oscillation.law, parameters, oscillation.frequency_Hz, oscillation.operating_depth, want);
  const double unit = oscillation.law_per_reading;
  const auto n = static_cast<Eigen::Index>(oscillation.readings.size());
  Response response;
  response.value.resize(n);
  if (want == Want::values_and_sensitivity) {
    response.sensitivity.resize(n, spectrum.storage_by.cols());
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [place, part] = oscillation.readings[static_cast<std::size_t>(i)];
    const auto row = static_cast<Eigen::Index>(place);
    const bool storage = part == Oscillation::Part::storage;
    response.value[i] = (storage ? spectrum.storage : spectrum.loss)[row] / unit;
    if (want == Want::values) continue;
    response.sensitivity.row(i) =
        (storage ? spectrum.storage_by : spectrum.loss_by).row(row) / unit;
  }
  return response;
}

std::string oscillation_label(Quantity quantity, double frequency_Hz) {
  return fmt::format("{} at {:.6g} Hz", quantity_short_name(quantity), frequency_Hz);
}

}  // namespace tpm::fit
