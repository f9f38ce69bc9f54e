#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tpm/files/json.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {

/// Standard uncertainties of one channel of an instrument: of a reading x
/// relative |x| and, independent of it, absolute.
struct ChannelUncertainty {
  double relative = 0.0;
  double absolute = 0.0;  ///< SI of the channel
};

/// Statements about the instrument of a recording: the block "instrument" of a curve's
/// description (docs/data_formats.md).
struct Instrument {
  std::string id;  ///< equal in two recordings: their errors are the same
  std::optional<ChannelUncertainty> force, depth, time;
  std::optional<double> zero;          ///< of the response before contact, standard uncertainty, SI
  std::optional<double> resolution;    ///< step of the response's readings, SI
  std::optional<double> noise;         ///< standard deviation of a reading of the response, SI
  std::string probe;                   ///< name of the tip; empty: it comes with the instrument
  std::optional<double> probe_radius;  ///< of a spherical or flat tip, m
  std::optional<double> radius;        ///< standard uncertainty of it, in parts of the radius
  std::map<std::string, std::string> stated;  ///< keys and texts of the block, for writing it again

  /// Standard deviation below which no reading of the response is known: the noise, and a step
  /// over sqrt 12.
  [[nodiscard]] double reading_floor() const;
  /// Equal in two recordings: the probe, and so the error of its radius, is the same.
  [[nodiscard]] std::string probe_id() const;
};

/// "0.5 % of reading", "0.1 % of range", "10 um": limits of a rectangular distribution, whose
/// standard uncertainty is the limit over sqrt 3; with "(standard)" behind it the standard
/// uncertainty itself, with "(k = 2)" twice that. Two parts may be joined by '+'.
/// @param range of the channel, for a share of it, SI
/// @param own what a share is of that is no share of the range: "reading", "radius"
/// Throws Error(bad_input).
[[nodiscard]] ChannelUncertainty parse_channel_uncertainty(std::string_view text,
                                                           Dimension dimension,
                                                           std::optional<double> range,
                                                           std::string_view where,
                                                           std::string_view own = "reading");

/// Reads the block. `force`, `zero`, `resolution` and `noise` are quantities of the response,
/// `depth` of the drive; a probe is one of forces over depths. Throws Error(bad_input) naming the
/// key.
[[nodiscard]] Instrument read_instrument(const Json& block, Dimension response, Dimension drive,
                                         std::string_view where);

/// That of a file that was given as a recording: of the description beside it. None if there is no
/// description or it does not state one.
[[nodiscard]] std::optional<Json> instrument_beside(const std::filesystem::path& recording);

}  // namespace tpm::files
