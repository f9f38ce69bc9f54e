#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/import/jpk_properties.hpp"
#include "tpm/files/zip_archive.hpp"

namespace tpm::files {

/// Turns what a channel stores (usually volts) into a physical quantity: the conversions of a JPK
/// file are linear, and so is their chain.
///     value = multiplier * stored + offset
struct JpkConversion {
  double multiplier = 1.0;
  double offset = 0.0;

  [[nodiscard]] double operator()(double stored) const noexcept {
    return multiplier * stored + offset;
  }
};

/// The conversion of a channel to a unit ("m", "N"): the channel's default one if that has the
/// unit, else the first that has. None if the channel is not calibrated so far. Throws
/// Error(bad_input) if a conversion is not linear or refers to itself.
[[nodiscard]] std::optional<JpkConversion> find_jpk_conversion(const JpkProperties& properties,
                                                               const std::string& channel,
                                                               std::string_view unit);

/// True if the segment holds samples of the channel.
[[nodiscard]] bool has_jpk_channel(const JpkProperties& properties, const std::string& channel);

/// The samples of a channel as they were stored, decoded: big-endian integers of 2, 4 or 8 bytes
/// with the multiplier and offset of their encoder, or IEEE numbers.
/// @param folder  of the segment in the archive, "segments/0/"
/// @param samples how many there are; another number of bytes is Error(bad_input)
[[nodiscard]] std::vector<double> read_jpk_channel(const ZipArchive& archive,
                                                   const std::string& folder,
                                                   const JpkProperties& properties,
                                                   const std::string& channel, std::size_t samples);

}  // namespace tpm::files
