#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/delimited.hpp"
#include "tpm/files/import/description.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::files {

/// The kinds of files that are imported, as --input-format takes them: "auto", which finds the kind
/// out from the content, "machine", "jpk", ...
[[nodiscard]] std::vector<std::string> import_formats();

/// One axis of a digitised figure.
struct DigitizedAxis {
  Quantity quantity = Quantity::time;
  Unit unit;
};

/// "contact_force:N" or "abscissa". Throws Error(bad_input).
[[nodiscard]] DigitizedAxis parse_axis(std::string_view text, std::string_view where);

/// Choices of the user for a file; everything left out is found in the file or is an error that
/// names the option. Nothing is guessed: a column without a unit is not imported.
struct ImportOptions {
  std::string format = "auto";  ///< one of import_formats()
  DelimitedOptions text;
  CurveHeader header;                    ///< id is set for each curve; sha256 is ignored
  std::optional<Provenance> provenance;  ///< else `measured` for machines, `digitized` for figures

  // Testing machines. A column is chosen by its name or its number from 1.
  std::optional<int> header_rows;
  std::optional<int> block;  ///< of several blocks of samples in a file, from 1
  std::string time_column;
  std::string drive_column;
  std::string response_column;
  std::string sd_column;
  std::string frequency_column;  ///< of a spectrum, as storage_column and loss_column
  std::string storage_column;
  std::string loss_column;
  std::optional<Quantity> drive_quantity;
  std::optional<Quantity> response_quantity;
  std::map<std::string, std::string> units;  ///< column name or number -> unit
  bool negate_drive = false;                 ///< for machines that count tension positive
  bool negate_response = false;
  /// Of the specimen, unloaded: a column of its length, or of how far it was drawn, is divided by
  /// it.
  std::optional<double> rest_length_m;
  std::optional<double> area_m2;  ///< of the specimen: a column of its force is divided by it
  /// Time of the step in the file's own clock, for G(t), J(t) and steps that are kept: earlier
  /// samples are left out, and times count from here.
  std::optional<double> step_time_s;
  std::optional<double> from_s;           ///< samples before this time of the file are left out
  std::optional<double> until_s;          ///< and those after this one
  std::optional<double> contact_force_N;  ///< above 0: samples before contact are left out
  int contact_samples = 3;                ///< number of samples in a row that must reach it, from 1

  // Force curves of an AFM: JPK files, whose channels drive_column and response_column may name,
  // and tables with the height of the piezo.
  std::optional<double> spring_constant_N_per_m;         ///< above 0; else that of the file
  std::optional<double> deflection_sensitivity_m_per_V;  ///< above 0; tables with a deflection in V
  std::vector<std::string> segments;  ///< kinds to read ("extend", "pause"); empty: all

  // Digitised figures.
  std::optional<DigitizedAxis> x;
  std::optional<DigitizedAxis> y;
  std::string dataset;            ///< only the dataset of this name
  std::optional<double> depth_m;  ///< imposed depth of a digitised relaxation curve
  std::optional<double> load_N;   ///< imposed load of a digitised creep curve
  TimeOrigin time_origin = TimeOrigin::none;
};

/// One thing that was understood, in words ("separator", "comma").
struct ImportFinding {
  std::string what;
  std::string value;
  bool told = false;  ///< true: a column's choice, or a finding that a reader would not expect

  [[nodiscard]] static ImportFinding told_of(std::string what, std::string value) {
    return {std::move(what), std::move(value), true};
  }
};

/// A column as it stood in the file.
struct ImportedColumn {
  Quantity quantity = Quantity::ordinate;
  Unit unit;
  Bound bound = Bound::value;
  std::vector<double> values;  ///< in `unit`, not SI: written as they were read
  bool shifted = false;        ///< zero was moved, so that the last digits are rounding noise
};

/// One curve of an imported file, before it is given the project's own form.
struct ImportedSeries {
  std::string name;                     ///< dataset or sheet; may be empty
  std::vector<ImportedColumn> columns;  ///< all of one length
  std::vector<int> lines;               ///< of the samples in the file; empty if they have none
  std::vector<ImportFinding> findings;
  std::vector<RecordedSegment> segments;  ///< empty if the file does not say
  std::string note;                       ///< becomes part of the description's note
  bool from_angle = false;  ///< storage or loss was computed from a phase angle or its tangent
};

/// A curve in the project's own form: `csv` and `description` are what the two files hold.
struct ImportedCurve {
  std::string name;
  CurveDescription description;
  std::string csv;
  std::vector<ImportFinding> findings;
};

/// A recording read into memory, and what was understood of its file.
struct RecordingFile {
  Recording recording;
  std::vector<ImportFinding> findings;
};

/// The series of a foreign file, as they stood in it.
struct ImportedFile {
  std::vector<ImportedSeries> series;
  Provenance usual = Provenance::measured;  ///< of such a file if the options give none
  std::string sha256;                       ///< of its bytes
};

/// Takes a foreign file apart; see import_curves. `options.dataset` chooses among several series.
[[nodiscard]] ImportedFile import_series(const std::filesystem::path& path,
                                         const ImportOptions& options);

/// Reads a foreign file. Throws Error(bad_input) with file, line and column. A digitised file may
/// hold several curves; a machine export holds one.
///
/// Digitised curves become points where the imposed quantity is known: force over depth, force over
/// time with `depth_m` and `time_origin`, depth over time with `load_N` and `time_origin`. All
/// others become recordings, and a table with frequency, storage and loss a spectrum.
[[nodiscard]] std::vector<ImportedCurve> import_curves(const std::filesystem::path& path,
                                                       const ImportOptions& options);

}  // namespace tpm::files
