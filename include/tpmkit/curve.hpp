#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/units.hpp"

namespace tpm {

/// Origin of a number. It accompanies every datum into every table and figure.
enum class Provenance { table, text, abstract, derived, assumed, digitized, measured };

[[nodiscard]] std::string_view provenance_name(Provenance provenance) noexcept;

/// Throws Error(bad_input) naming the seven known words.
[[nodiscard]] Provenance parse_provenance(std::string_view text, std::string_view where);

/// Physical quantity of a column.
enum class Quantity {
  time,                ///< s
  indentation_depth,   ///< m, positive into the tissue
  contact_force,       ///< N, positive in compression
  load,                ///< N, imposed
  relative_length,     ///< length over reference length, dimensionless
  strain,              ///< of tension, compression or shear, dimensionless, 0 where undeformed
  stress,              ///< Pa
  frequency,           ///< Hz (cycles per second; rad/s is converted)
  storage_modulus,     ///< Pa, in phase with the strain
  loss_modulus,        ///< Pa, a quarter of a cycle ahead of it
  storage_stiffness,   ///< N/m, the same for force over displacement
  loss_stiffness,      ///< N/m
  relaxation_modulus,  ///< Pa, stress after a unit step of strain at time 0
  creep_compliance,    ///< 1/Pa, strain after a unit step of stress at time 0
  abscissa,            ///< x of a problem without physical meaning, a plain number
  ordinate,            ///< y of the same
};

/// The word used in files: "indentation_depth".
[[nodiscard]] std::string_view quantity_name(Quantity quantity) noexcept;

/// Throws Error(bad_input) naming the known words.
[[nodiscard]] Quantity parse_quantity_name(std::string_view text, std::string_view where);

[[nodiscard]] Dimension quantity_dimension(Quantity quantity) noexcept;

/// True for drives whose response is a stress: relative length and strain.
[[nodiscard]] bool is_answered_by_stress(Quantity drive) noexcept;

/// True for the response to a unit step at time 0: relaxation modulus or creep compliance. Such a
/// recording has times and no drive.
[[nodiscard]] bool is_step_response(Quantity quantity) noexcept;

/// The short name that begins a column header or a JSON key: "depth", "force", "time".
[[nodiscard]] std::string_view quantity_short_name(Quantity quantity) noexcept;

/// A key that ends in the SI unit of its value: "eta1_Pa_s", "storage_N_per_m", "ratio".
[[nodiscard]] std::string si_key(std::string_view name, Dimension dimension);

/// Short name and SI unit, as machine-readable output writes it: "depth_m", "relative_length".
/// `part` ("lower", "sd") goes between the two: "force_lower_N".
[[nodiscard]] std::string si_key(Quantity quantity, std::string_view part = {});

/// The quantity that a datum reports and a model computes.
enum class Observable {
  contact_force,      ///< N, under an imposed indentation depth
  indentation_depth,  ///< m, under an imposed load
};

[[nodiscard]] Quantity observable_quantity(Observable observable) noexcept;

/// The indenter of an experiment.
struct ProbeShape {
  std::string shape;  ///< "hemisphere", "sphere", "flat punch"; empty if unknown
  std::optional<double> diameter_m;
  std::optional<Provenance> provenance;
};

/// Description of a data file, from its JSON.
struct CurveHeader {
  std::string id;  ///< file name without ending, e.g. "evren_relaxation"
  std::string title;
  std::string citation;  ///< authors, journal, year, pages
  std::string doi;
  std::string specimen;
  ProbeShape probe;
  std::string note;
  std::string sha256;  ///< of the CSV bytes
};

/// One reading: a value, or a band [lower, upper] where only a range is known.
struct Datum {
  std::string label;              ///< e.g. "peak", "end"; empty if the file has no labels
  std::optional<double> depth_m;  ///< imposed indentation depth, at least 0
  std::optional<double> load_N;   ///< imposed load, at least 0
  std::optional<double> time_s;   ///< see PointSet::time_origin; none for a static reading
  std::optional<double> value;    ///< SI; none for a band
  std::optional<double> lower;    ///< SI; set together with upper, for a band
  std::optional<double> upper;
  std::optional<double> sd;  ///< standard deviation, SI, if the file has one
  Provenance provenance = Provenance::assumed;
  std::string where;  ///< "Table 2", "abstract"
  std::string note;
  int line = 0;  ///< line of the CSV file

  [[nodiscard]] bool is_band() const noexcept { return lower.has_value(); }
};

/// A fault in a row, and what was expected.
struct RowFault {
  std::string column, what, expected;
};

/// The first fault of a reading: neither or both of a value and a band, nothing imposed, a negative
/// depth, load, time or standard deviation, or a number that is not finite.
[[nodiscard]] std::optional<RowFault> find_datum_fault(const Datum& datum, Observable observable);

/// Origin of the times of a point set.
enum class TimeOrigin { none, end_of_ramp, load_applied };

/// "none", "end_of_ramp" or "load_applied".
[[nodiscard]] std::string_view time_origin_name(TimeOrigin origin) noexcept;

/// Throws Error(bad_input) naming the known words.
[[nodiscard]] TimeOrigin parse_time_origin(std::string_view text, std::string_view where);

/// Readings from separate experiments: the printed numbers of a paper.
struct PointSet {
  CurveHeader header;
  Observable observable = Observable::contact_force;
  TimeOrigin time_origin = TimeOrigin::none;
  std::optional<Provenance> time_provenance;  ///< if the times themselves are assumed, say
  std::vector<Datum> data;
};

/// A recording: what was imposed (`drive`) and what was observed (`response`), sampled together.
/// For an indentation they are depth and contact force, for a stretched strip relative length and
/// stress. All non-empty vectors have the length of `response`.
struct Recording {
  CurveHeader header;
  Provenance provenance = Provenance::measured;
  Quantity drive_quantity = Quantity::indentation_depth;
  Quantity response_quantity = Quantity::contact_force;
  std::vector<double> time_s;       ///< strictly increasing; empty if the file has no times
  std::vector<double> drive;        ///< SI; empty if only the response was recorded
  std::vector<double> response;     ///< SI; never empty
  std::vector<double> response_sd;  ///< SI, at least 0; empty if the file has none

  /// The drive of an indentation. Throws Error(bad_input), naming the recording, if the drive is
  /// something else or missing.
  [[nodiscard]] const std::vector<double>& depth_m() const;
  /// The response of an indentation. Throws Error(bad_input) if the response is no contact force.
  [[nodiscard]] const std::vector<double>& force_N() const;
  /// Its standard deviation, empty if the file has none. Throws as force_N().
  [[nodiscard]] const std::vector<double>& force_sd_N() const;
};

/// Oscillatory data: storage and loss over frequency, as moduli (Pa) or as dynamic stiffnesses
/// (N/m). All non-empty vectors have the length of `frequency_Hz`; the order is the file's.
struct Spectrum {
  CurveHeader header;
  Provenance provenance = Provenance::measured;
  Dimension dimension = Dimension::stress;  ///< or stiffness
  std::vector<double> frequency_Hz;         ///< above 0, each once; never empty
  std::vector<double> storage;              ///< SI, at least 0
  std::vector<double> loss;                 ///< SI, at least 0
  std::vector<double> storage_sd;           ///< SI, at least 0; empty if the file has none
  std::vector<double> loss_sd;
};

/// Quantities of the columns of a spectrum of that dimension.
struct SpectrumQuantities {
  Quantity storage;
  Quantity loss;
};
[[nodiscard]] SpectrumQuantities spectrum_quantities(Dimension dimension) noexcept;

/// The first invalid row of a spectrum, and the reason.
struct SpectrumFault {
  std::size_t row;
  std::string what;
  std::string expected;
};

/// Checks, in any unit, that every frequency is above 0 and occurs once, and that storage and loss
/// are at least 0.
[[nodiscard]] std::optional<SpectrumFault> find_spectrum_fault(const std::vector<double>& frequency,
                                                               const std::vector<double>& storage,
                                                               const std::vector<double>& loss);

/// A single value from the literature that is not part of a curve: a modulus, a time constant.
struct NamedValue {
  std::string name;             ///< unique in its file: "carter_elastic_modulus"
  std::string quantity;         ///< in words: "elastic modulus"
  Unit unit;                    ///< as printed; the numbers below are SI
  std::optional<double> value;  ///< none for a range
  std::optional<double> lower;  ///< a range may be open on one side ("up to 50 %")
  std::optional<double> upper;
  std::optional<double> plus_minus;  ///< the number printed after the sign, of unknown meaning
  Provenance provenance = Provenance::assumed;
  std::string where;
  std::string formula;  ///< only for provenance `derived`, and always there
  std::string note;
  int line = 0;
};

/// The first fault of a named value, except a duplicate name.
[[nodiscard]] std::optional<RowFault> find_value_fault(const NamedValue& value);

/// Single values, in the order of the file.
struct ValueSet {
  CurveHeader header;
  std::vector<NamedValue> values;

  /// Throws Error(bad_input) naming the file if there is no such value.
  [[nodiscard]] const NamedValue& at(std::string_view name) const;
};

}  // namespace tpm
