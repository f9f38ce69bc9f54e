#pragma once
#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::test {

/// Names of laws, of each kind at least one.
inline const std::vector<std::string> kLaws{
    "linear",           "linear-1",          "linear-2",        "linear-3-elastic",
    "linear-1-elastic", "linear-2-relaxing", "hertz-1",         "power-2",
    "linear-2-fluid",   "power-1-elastic",   "linear-2-series", "power-1-elastic-series"};

/// Plausible parameters of any law: stiffnesses of tens of N/m, times around a second.
inline std::vector<double> random_parameters(const LawModel& law, base::Random& random) {
  std::vector<double> values;
  for (const LawParameter& p : law.law_parameters()) {
    const double u = random.uniform();
    if (p.dimension == Dimension::stiffness) {
      values.push_back(10.0 * std::pow(10.0, u));
    } else if (p.dimension == Dimension::time) {
      values.push_back(0.05 * std::pow(100.0, u));
    } else if (p.name == "exponent") {
      values.push_back(1.2 + u);
    } else if (p.name == "alpha") {
      values.push_back(0.3 + 0.6 * u);
    } else if (p.name == "tension_share") {
      values.push_back(0.1 + 0.8 * u);
    } else if (p.name == "spacing") {
      values.push_back(0.01 + 0.02 * u);
    } else if (p.name == "contact") {
      values.push_back(2e-4 * u);
    } else {
      values.push_back(0.01 * u);
    }
  }
  return values;
}

inline double largest_difference(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

}  // namespace tpm::test
