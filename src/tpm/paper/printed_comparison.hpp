#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/json.hpp"
#include "tpm/fit/select/fit_variations.hpp"
#include "tpm/fit/validate/requirement.hpp"
#include "tpmkit/curve.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::paper {

/// The paper's model against one printed number or range, in the words of ASME V&V 20: S, D,
/// E = S - D, and what is known of u_val^2 = u_num^2 + u_input^2 + u_D^2. SI.
struct PrintedComparison {
  std::string experiment;           ///< "relaxation", "static", "creep"
  std::string parameters;           ///< "printed, step", "fitted to the other depths", ...
  bool printed_parameters = false;  ///< else fitted ones
  std::string quantity;             ///< "peak force at 4 mm"
  double imposed = 0.0;             ///< depth, m, or load, N
  Unit unit;                        ///< in which it is shown
  double simulated = 0.0;           ///< S
  double low = 0.0;                 ///< D is in [low, high]; a value: both are it
  double high = 0.0;
  double u_num = 0.0, u_input = 0.0;
  double u_D = 0.0;             ///< of the printed digits: scatter and instrument are not stated
  fit::ErrorWithUncertainty e;  ///< from the nearest place of the range; 0 within it
  /// The number took part in the choice of a parameter: agreement is then a calibration residual,
  /// which confirms nothing; disagreement counts all the more.
  bool took_part_in_choice = false;
  fit::ModelVerdict verdict = fit::ModelVerdict::no_requirement;
  std::string remark;  ///< what would change the verdict, or must be improved
  /// Requirement, as a share of D, below which the verdict is "not adequate" (0: for none).
  double not_adequate_below = 0.0;
  /// Requirement from which on it is "adequate".
  double adequate_from = 0.0;

  [[nodiscard]] bool is_range() const { return high > low; }
};

/// Begins the remark on a range that is wider than the requirement.
inline constexpr std::string_view kOnlyARange = "D is only known to lie in a range of ";

/// Fills e, verdict, remark and the two limits from S, D and the uncertainties. The model error S -
/// D is compared with R for every D that the range allows: adequate, or not adequate, only if it is
/// so for all of them.
/// @param share R as a share of D, above 0 and below 1
void judge_printed(PrintedComparison& comparison, double share);

/// Input of the comparisons.
struct PrintedExperiments {
  TpmParameters printed;  ///< 12 kPa, 5 Pa s, x = 30 mm
  PointSet relaxation, static_bands, creep;
};

/// The printed relaxation, static and creep data against the paper's model with printed parameters
/// (as a step, as the paper computes it, and as a ramp of 4 mm/s) and with parameters that were
/// fitted to the relaxation data: each depth by the fit that left it out, so that no number is
/// compared with parameters that were fitted to it.
/// @param share as above
/// Throws as run_fit.
[[nodiscard]] std::vector<PrintedComparison> compare_with_print(const PrintedExperiments& data,
                                                                const fit::FitStudy& study,
                                                                double share);

[[nodiscard]] Json to_json(const std::vector<PrintedComparison>& comparisons, double share);

}  // namespace tpm::paper
