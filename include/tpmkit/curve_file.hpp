#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tpmkit/curve.hpp"

namespace tpm {

/// Any of the four kinds of curve file.
using Curve = std::variant<PointSet, Recording, ValueSet, Spectrum>;

/// Name of the kind: "points", "recording", "values" or "spectrum".
[[nodiscard]] std::string_view curve_kind(const Curve& curve) noexcept;

[[nodiscard]] const CurveHeader& curve_header(const Curve& curve) noexcept;

/// Number of data, samples, values or frequencies.
[[nodiscard]] std::size_t curve_size(const Curve& curve) noexcept;

/// Reads a curve: a CSV file and the JSON description of the same name beside it
/// (schemas/curve.schema.json). `path_or_id` is a path if it ends in .csv or .json (either of the
/// two), else the id of a curve in the data folder of share_dir(). Every row and key is checked;
/// the first fault throws Error(bad_input) "FILE:LINE: column 'C': WHAT; expected ...".
[[nodiscard]] Curve load_curve(const std::string& path_or_id);

/// As load_curve, and Error(bad_input) if the file is of another kind.
[[nodiscard]] PointSet load_points(const std::string& path_or_id);
[[nodiscard]] Recording load_recording(const std::string& path_or_id);
[[nodiscard]] ValueSet load_values(const std::string& path_or_id);
[[nodiscard]] Spectrum load_spectrum(const std::string& path_or_id);

/// One line of a table of contents.
struct CurveSummary {
  std::string id;
  std::string kind;
  std::size_t size = 0;
  std::string title;
};

/// The curves in the data folder of share_dir(), in alphabetical order of their ids. Reads and
/// checks them all.
[[nodiscard]] std::vector<CurveSummary> list_curves();

}  // namespace tpm
