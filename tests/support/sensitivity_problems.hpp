#pragma once
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/sensitivity.hpp"

namespace tpm::base {

/// A function of the unit cube whose Sobol indices are known.
struct SensitivityProblem {
  std::string name;
  int inputs = 0;
  std::function<double(const std::vector<double>&)> output;
  double variance = 0.0;
  std::vector<double> first_order, total;
};

/// sin x1 + a sin^2 x2 + b x3^4 sin x1, x in (-pi, pi)^3, a = 7, b = 0.1 (Ishigami and Homma 1990).
inline SensitivityProblem ishigami() {
  using std::numbers::pi;
  constexpr double a = 7.0, b = 0.1;
  const double pi4 = std::pow(pi, 4), pi8 = pi4 * pi4;
  const double alone1 = 0.5 * std::pow(1.0 + b * pi4 / 5.0, 2), alone2 = a * a / 8.0;
  const double both13 = b * b * pi8 * (1.0 / 18.0 - 1.0 / 50.0);
  const double all = alone1 + alone2 + both13;
  return {"Ishigami",
          3,
          [](const std::vector<double>& u) {
            const auto x = [&](std::size_t i) { return pi * (2.0 * u[i] - 1.0); };
            return std::sin(x(0)) + a * std::pow(std::sin(x(1)), 2) +
                   b * std::pow(x(2), 4) * std::sin(x(0));
          },
          all,
          {alone1 / all, alone2 / all, 0.0},
          {(alone1 + both13) / all, alone2 / all, both13 / all}};
}

/// Product of (|4 x_i - 2| + a_i) / (1 + a_i) (Sobol 1993), a = 0, 1, 4.5, 9.
inline SensitivityProblem g_function() {
  const std::vector<double> a{0.0, 1.0, 4.5, 9.0};
  SensitivityProblem p{"G-function",
                       static_cast<int>(a.size()),
                       [a](const std::vector<double>& u) {
                         double product = 1.0;
                         for (std::size_t i = 0; i < a.size(); ++i)
                           product *= (std::abs(4.0 * u[i] - 2.0) + a[i]) / (1.0 + a[i]);
                         return product;
                       },
                       0.0,
                       {},
                       {}};
  double all = 1.0;
  const auto alone = [&](std::size_t i) { return 1.0 / (3.0 * std::pow(1.0 + a[i], 2)); };
  for (std::size_t i = 0; i < a.size(); ++i) all *= 1.0 + alone(i);
  p.variance = all - 1.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    p.first_order.push_back(alone(i) / p.variance);
    p.total.push_back(alone(i) * all / (1.0 + alone(i)) / p.variance);
  }
  return p;
}

inline std::vector<double> outputs_of(const SensitivityProblem& problem,
                                      const SensitivityDesign& design) {
  const auto set = sensitivity_points(design);
  std::vector<double> outputs, u(static_cast<std::size_t>(problem.inputs));
  for (std::uint64_t cell = 0; cell < design.cells(); ++cell) {
    for (int i = 0; i < problem.inputs; ++i)
      u[static_cast<std::size_t>(i)] = set->coordinate(cell, i);
    outputs.push_back(problem.output(u));
  }
  return outputs;
}

}  // namespace tpm::base
