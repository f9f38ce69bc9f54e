#include "tpm/accuracy/verify/certified_fit.hpp"

#include <limits>

namespace tpm::accuracy {

std::vector<FitParameter> certified_parameters(std::span<const double> start) {
  std::vector<FitParameter> parameters;
  for (std::size_t i = 0; i < start.size(); ++i) {
    FitParameter p;
    p.name = "b" + std::to_string(i + 1);
    p.unit = parse_unit("", "certified problem");
    p.scale = Scale::linear;
    p.start = start[i];
    p.lower = -std::numeric_limits<double>::infinity();
    p.upper = std::numeric_limits<double>::infinity();
    parameters.push_back(p);
  }
  return parameters;
}

bool CertifiedResiduals::evaluate(std::span<const double> b, Eigen::VectorXd& residual,
                                  RowMatrix* jacobian) const {
  std::vector<double> slopes(b.size());
  residual.resize(residual_count());
  if (jacobian != nullptr) {
    jacobian->resize(residual.size(), static_cast<Eigen::Index>(b.size()));
  }
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    residual[i] = scale_ * problem_.curve(problem_.x[k], b, slopes) - problem_.y[k];
    if (jacobian == nullptr) continue;
    for (std::size_t j = 0; j < b.size(); ++j) {
      (*jacobian)(i, static_cast<Eigen::Index>(j)) = scale_ * slopes[j];
    }
  }
  return residual.allFinite() && (jacobian == nullptr || jacobian->allFinite());
}

Threshold certified_threshold(const CertifiedProblem& problem) {
  Threshold threshold;
  threshold.scale_known = false;
  threshold.data_count = static_cast<int>(problem.x.size());
  threshold.parameter_count = static_cast<int>(problem.estimates.size());
  return threshold;
}

FitResult fit_certified(const CertifiedProblem& problem, const std::vector<double>& start,
                        double flaw, bool profiles) {
  return fit_residuals(CertifiedResiduals(problem, flaw), certified_parameters(start), {start},
                       certified_threshold(problem), profiles);
}

}  // namespace tpm::accuracy
