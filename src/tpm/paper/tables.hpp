#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/paper/claims/claims.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::paper {

/// Assumption of a table about the loading.
enum class TableMode {
  as_printed,  ///< a step, Eqs. 15 and 16: the force at 0+ and for t -> infinity
  consistent,  ///< ramp-and-hold with the stated eta1: force at the end of the ramp and of the hold
};

/// A sweep over depths and spacings.
struct TableRequest {
  TableMode mode = TableMode::as_printed;
  std::vector<double> depths_m{0.002, 0.004, 0.006, 0.008};    ///< > 0, each once
  std::vector<double> spacings_m{0.020, 0.025, 0.030, 0.035};  ///< > 0, each once
  TpmParameters parameters;                                    ///< spacing_m is not used
  double rate_m_per_s = 0.004;                                 ///< consistent mode, > 0
  double hold_s = 30.0;                                        ///< consistent mode, > 0
};

/// A printed cell and what recomputing it gives, in the printed unit.
struct PrintedCell {
  Unit unit;
  DigitCheck from_computed_lambda1;
  std::optional<DigitCheck> from_printed_lambda1;  ///< forces only
};

/// A measured value of the paper's comparison and the model's misfit to it.
struct MeasuredCell {
  std::string text;  ///< as printed
  Unit unit;
  double si = 0.0;
  double misfit_percent = 0.0;  ///< (model - measured) / measured
};

/// One number of a row: lambda1 in Pa or a force in N.
struct TableCell {
  double value = 0.0;  ///< SI, from the computed lambda1
  std::optional<PrintedCell> printed;
  std::optional<MeasuredCell> measured;
};

/// One depth and spacing.
struct TableRow {
  double depth_m = 0.0;
  double spacing_m = 0.0;
  std::string printed_where;  ///< "Table 1"; empty if the paper does not print this row
  TableCell lambda1;
  TableCell peak_force;
  TableCell end_force;
};

/// A row of the comparison with a band of static forces (Table 5).
struct BandRow {
  double depth_m = 0.0;
  double spacing_m = 0.0;
  std::string printed_where;
  TableCell lambda1;
  TableCell force;                  ///< relaxed force
  std::string band_low, band_high;  ///< as printed
  Unit band_unit;
  double band_low_N = 0.0, band_high_N = 0.0;
  bool inside = false;
};

/// Number of printed cells that follow from the formulas.
struct CellCounts {
  int cells = 0;
  int by_rounding = 0;
  int by_truncation = 0;  ///< not already by rounding
  int last_digit_off = 0;
  int differ = 0;

  [[nodiscard]] int explained() const noexcept { return by_rounding + by_truncation; }
  void add(const DigitCheck& check);
};

struct TableSummary {
  CellCounts lambda1;
  CellCounts force_from_printed_lambda1;
  CellCounts force_from_computed_lambda1;
};

struct TablesResult {
  TableRequest request;
  std::vector<TableRow> rows;  ///< depth by depth, spacings within
  std::vector<BandRow> bands;  ///< only for depths that are both asked for and printed
  TableSummary summary;        ///< of the relaxation tables (1-4)
};

/// Computes the tables. Printed and measured values are attached to the rows whose depth and
/// spacing the paper prints, whatever the other parameters are.
/// Throws Error(bad_input) for values out of range or repeated.
[[nodiscard]] TablesResult make_tables(const TableRequest& request,
                                       const std::vector<PrintedTable>& printed);

/// docs/json.md lists the keys.
[[nodiscard]] Json to_json(const TablesResult& result);

}  // namespace tpm::paper
