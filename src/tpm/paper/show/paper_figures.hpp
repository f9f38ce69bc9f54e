#pragma once
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/figure.hpp"
#include "tpmkit/curve.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::paper {

/// A creep experiment as the paper prints it (Sec. 4.2, beside Figs. 8 and 9).
struct PrintedCreep {
  std::string figure;        ///< "8"
  double load_N = 0.0;       ///< of the data it is compared with
  double lambda1_Pa = 0.0;   ///< the frozen value the paper puts in
  double end_depth_m = 0.0;  ///< the result it prints for t -> infinity (Eq. 18)
};

/// Everything that Figures 6-10 need besides the model.
struct PaperFigureData {
  TpmParameters paper;    ///< as stated: 12 kPa, 5 Pa s, x = 30 mm
  TpmParameters fitted;   ///< what a fit to the relaxation tables found
  std::string fitted_as;  ///< how, in a few words ("E = 13.9 kPa, eta1 = 2e5 Pa s, x = 71 mm")
  PointSet static_bands;
  PointSet relaxation;
  PointSet creep;
  std::vector<PrintedCreep> printed_creep;
  ValueSet literature;  ///< single values, viscosities among them
};

/// Fig. 7: relaxation at 4 mm after a 4 mm/s ramp, with the paper's dashpot and with the fitted
/// one.
[[nodiscard]] Figure relaxation_figure(const PaperFigureData& data);

/// Figs. 8 and 9: creep under a constant load over 300 s, on a linear and a logarithmic time axis.
[[nodiscard]] Figure creep_figure(const PaperFigureData& data, const PrintedCreep& printed);

/// Fig. 10: 4 mm reached at 4, 2 and 1 mm/s, with the paper's dashpot and with the fitted one.
[[nodiscard]] Figure rates_figure(const PaperFigureData& data);

/// Not in the paper: both dashpots over frequency, with the viscosities of elastography.
[[nodiscard]] Figure spectrum_figure(const PaperFigureData& data);

/// The paper's five in its order, and the spectrum.
[[nodiscard]] std::vector<Figure> paper_figures(const PaperFigureData& data);

}  // namespace tpm::paper
