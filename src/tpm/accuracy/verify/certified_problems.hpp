#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"

namespace tpm::accuracy {

/// A problem of the NIST Statistical Reference Datasets, nonlinear regression
/// (https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml): data, two published starts, and
/// estimates with standard deviations certified to 11 digits, which two programs found in 128-bit
/// arithmetic.
struct CertifiedProblem {
  std::string name;
  std::string difficulty;  ///< as NIST grades it: lower, average, higher
  /// f(x; b), and its derivatives by b in d.
  std::function<double(double x, std::span<const double> b, std::span<double> d)> curve;
  std::vector<double> x, y;
  std::vector<std::vector<double>> starts;  ///< the far one first
  std::vector<double> estimates, standard_deviations;
  double sum_of_squares = 0.0;

  /// The data were generated without noise: their residuals are rounding, of which nothing is
  /// certified that arithmetic in double precision could reproduce.
  [[nodiscard]] bool noise_free() const { return sum_of_squares < 1e-20; }
};

/// Twelve of the 27, of all three grades.
[[nodiscard]] const std::vector<CertifiedProblem>& certified_problems();

}  // namespace tpm::accuracy
