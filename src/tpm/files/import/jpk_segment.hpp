#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/zip_archive.hpp"

namespace tpm::files {

using PropertyMap = std::map<std::string, std::string, std::less<>>;

/// Reads a Java properties file: lines of `key=value`, comments that begin with '#' or '!', lines
/// continued with a backslash at their end, and characters escaped with one.
[[nodiscard]] PropertyMap parse_properties(std::string_view text);

/// The properties of one segment of a JPK force file. Since format version 0.12 they may refer to
/// blocks that the segments share: `channel.height.lcd-info.*=3` in the segment's own file means
/// that `lcd-info.3.REST` of shared-data/header.properties is `channel.height.REST`.
class JpkProperties {
 public:
  /// @param shared properties of shared-data/header.properties; must outlive this object
  /// @param place  for errors: the file and the member that holds `own`
  JpkProperties(PropertyMap own, const PropertyMap& shared, std::string place);

  [[nodiscard]] std::optional<std::string> find(std::string_view key) const;

  /// The first of several keys that exists: format versions name some things differently.
  [[nodiscard]] std::optional<std::string> find_any(std::initializer_list<std::string> keys) const;

  /// Throws Error(bad_input) naming the key if it is missing.
  [[nodiscard]] std::string text(std::string_view key) const;

  /// Throws Error(bad_input) naming the key if it is missing or no finite number.
  [[nodiscard]] double number(std::string_view key) const;

  /// "FILE: MEMBER: key KEY", for errors.
  [[nodiscard]] std::string place_of(std::string_view key) const;

 private:
  struct Reference {
    std::string head;   ///< "channel.height."
    std::string block;  ///< "lcd-info.3."
  };
  PropertyMap own_;
  const PropertyMap* shared_;
  std::string place_;
  std::vector<Reference> references_;
};

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
