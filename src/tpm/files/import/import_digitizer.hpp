#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// One digitised curve: pairs of plot coordinates.
struct DigitizedDataset {
  std::string name;  ///< empty if the file has no names
  std::vector<double> x;
  std::vector<double> y;
};

/// WebPlotDigitizer CSV: rows of x and y without a header, or a row of dataset names over every
/// second column, a row X,Y,X,Y,... and columns that may end at different rows.
[[nodiscard]] std::vector<DigitizedDataset> read_wpd_csv(const DelimitedTable& table,
                                                         const std::string& file);

/// WebPlotDigitizer project. Version 4 keeps datasets under datasetColl; a point without "value" is
/// computed from its pixels and the four calibration points of its XY axes (linear or logarithmic,
/// also rotated or skewed). Version 3 keeps them under wpd.dataSeries, always with values.
[[nodiscard]] std::vector<DigitizedDataset> read_wpd_json(std::string_view text,
                                                          const std::string& file);

/// Engauge Digitizer CSV: a title row "x,Curve1,Curve2" (or x,Curve1,x,Curve2), then rows in which
/// the fields of curves without a point are empty; each further title row begins a new block.
[[nodiscard]] std::vector<DigitizedDataset> read_engauge(const DelimitedTable& table,
                                                         const std::string& file);

/// True if a table can only be such a file.
[[nodiscard]] bool is_wpd_csv(const DelimitedTable& table);
[[nodiscard]] bool is_engauge(const DelimitedTable& table);

}  // namespace tpm::files
