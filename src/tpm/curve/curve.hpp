#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tpm {

/// Where a number comes from. It travels with every datum into every table and figure.
enum class Provenance { table, text, abstract, derived, assumed, digitized, measured };

[[nodiscard]] std::string_view provenance_name(Provenance provenance) noexcept;

/// Throws Error(bad_input) naming the seven known words.
[[nodiscard]] Provenance parse_provenance(std::string_view text, std::string_view where);

/// What a datum reports, and so what a model must answer.
enum class Observable {
  contact_force,      ///< N, under an imposed indentation depth
  indentation_depth,  ///< m, under an imposed load
};

/// The indenter of an experiment.
struct Probe {
  std::string shape;  ///< "hemisphere", "sphere", "flat punch"; empty if unknown
  std::optional<double> diameter_m;
  std::optional<Provenance> provenance;
};

/// What a data file says about itself, from its JSON description.
struct CurveHeader {
  std::string id;  ///< file name without ending, e.g. "evren_relaxation"
  std::string title;
  std::string citation;  ///< authors, journal, year, pages
  std::string doi;
  std::string specimen;
  Probe probe;
  std::string note;
  std::string sha256;  ///< of the CSV bytes
};

/// One reading: a value, or a band [lower, upper] where only a range is known.
struct Datum {
  std::string label;              ///< e.g. "peak", "end"; empty if the file has no labels
  std::optional<double> depth_m;  ///< imposed indentation depth
  std::optional<double> load_N;   ///< imposed load
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

/// What the times of a point set count from.
enum class TimeOrigin { none, end_of_ramp, load_applied };

/// Readings from separate experiments: the printed numbers of a paper.
struct PointSet {
  CurveHeader header;
  Observable observable = Observable::contact_force;
  TimeOrigin time_origin = TimeOrigin::none;
  std::optional<Provenance> time_provenance;  ///< if the times themselves are assumed, say
  std::vector<Datum> data;
};

/// A recording: time, indentation depth and contact force sampled together, time increasing.
struct Recording {
  CurveHeader header;
  Provenance provenance = Provenance::measured;
  std::vector<double> time_s;
  std::vector<double> depth_m;
  std::vector<double> force_N;
  std::vector<double> force_sd_N;  ///< empty if the file has none
};

}  // namespace tpm
