#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tpm/files/json.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpmkit/curve.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {

/// The part of a reading that a column holds.
enum class Bound { value, lower, upper, sd };

/// "value", "lower", "upper" or "sd".
[[nodiscard]] std::string_view bound_name(Bound bound) noexcept;

/// The description of one CSV column.
struct ColumnDescription {
  Quantity quantity = Quantity::ordinate;
  Unit unit;
  Bound bound = Bound::value;
  std::optional<Provenance> provenance;  ///< of the column where it differs from the row's
  std::string note;
};

/// A part of a recording that the instrument ran as one, such as the approach or a pause.
struct RecordedSegment {
  std::string kind;     ///< the instrument's word: "extend", "pause", "retract"
  std::string control;  ///< mode of the run, "constant-height-pause"; empty if not known
  std::size_t samples = 0;
};

/// "extend (1000 samples), pause (5000 samples, constant-height-pause)".
[[nodiscard]] std::string segments_words(const std::vector<RecordedSegment>& segments);

/// The JSON file beside a CSV file.
struct CurveDescription {
  CurveHeader header;
  std::string kind;                    ///< "points", "recording", "spectrum" or "values"
  std::optional<Quantity> observable;  ///< points and recordings
  TimeOrigin time_origin = TimeOrigin::none;
  std::optional<Provenance> provenance;  ///< of a whole recording or spectrum
  std::map<std::string, ColumnDescription> columns;
  /// Of a recording, in order; together they hold all of its samples. Empty if not known.
  std::vector<RecordedSegment> segments;
  Json instrument;  ///< the block "instrument" as it stands there (read_instrument); else null
};

/// The description of a curve.
[[nodiscard]] const FileKind& curve_kind();

/// Reads and checks a description; header.sha256 stays empty. Throws Error(bad_input) naming the
/// key.
[[nodiscard]] CurveDescription read_description(const std::filesystem::path& path);

/// The inverse of read_description.
[[nodiscard]] Json description_json(const CurveDescription& description);

}  // namespace tpm::files
