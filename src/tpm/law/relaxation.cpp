#include "tpm/law/relaxation.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/law/law_model.hpp"
#include "tpm/law/operational_stiffness.hpp"
#include "tpm/solve/laplace_contour.hpp"

namespace tpm {
namespace {

/// The inverse transform at t of (1/s) f(operational stiffness).
/// @param f of the stiffness; returns its value and its derivative by the stiffness
template <class Function>
SlopedNumber inverse_over_s(const LawSpec& spec, std::span<const double> values, double t_s,
                            const Function& f) {
  LawModel(spec).require_in_range(values);
  if (!(t_s > 0.0 && std::isfinite(t_s))) {
    throw bad_input(fmt::format("law {}", law_name(spec)), fmt::format("time {} s", shortest(t_s)),
                    "a finite time above 0 s");
  }
  const OperationalStiffness stiffness(spec, values);
  const double log_t = std::log(t_s);
  SlopedNumber sum{0.0, Eigen::VectorXd::Zero(std::ssize(values))};
  for (const ContourNode& node : contour_nodes()) {
    const ComplexStiffness g = stiffness.at(node.log_s - log_t);
    const auto [value, slope] = f(g.value);
    const std::complex<double> weight = node.weight / node.s;
    sum.value += (weight * value).real();
    sum.by += (weight * slope * g.by).real().transpose();
  }
  return sum;
}

struct WithSlope {
  std::complex<double> value, slope;
};

}  // namespace

SlopedNumber law_relaxation(const LawSpec& spec, std::span<const double> values, double t_s) {
  return inverse_over_s(spec, values, t_s, [](std::complex<double> g) {
    return WithSlope{g, 1.0};
  });
}

SlopedNumber law_creep(const LawSpec& spec, std::span<const double> values, double t_s) {
  SlopedNumber j = inverse_over_s(spec, values, t_s, [](std::complex<double> g) {
    return WithSlope{1.0 / g, -1.0 / (g * g)};
  });
  if (std::isfinite(j.value)) return j;
  throw bad_input(fmt::format("law {}", law_name(spec)), "no stiffness, so no compliance",
                  "a stiffness above 0");
}

}  // namespace tpm
