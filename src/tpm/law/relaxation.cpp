#include "tpm/law/relaxation.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/laplace_contour.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::law {

StepResponse::StepResponse(const LawSpec& spec, std::span<const double> values)
    : spec_(spec), count_(std::ssize(values)), stiffness_(spec, values) {
  const bool fractional = spec.fractional != Fractional::none;
  nodes_.reserve(contour_nodes().size());
  for (const ContourNode& node : contour_nodes()) {
    nodes_.push_back({node.log_s, node.weight / node.s,
                      fractional ? stiffness_.powers(node.log_s) : OperationalStiffness::Powers{}});
  }
}

template <class Function>
SlopedNumber StepResponse::inverse_over_s(double t_s, const Function& f) const {
  if (!(t_s > 0.0 && std::isfinite(t_s))) {
    throw bad_input(fmt::format("law {}", law_name(spec_)), fmt::format("time {} s", shortest(t_s)),
                    "a finite time above 0 s");
  }
  const double log_t = std::log(t_s);
  const OperationalStiffness::PowersOverTime over_time(stiffness_, log_t);
  SlopedNumber sum{0.0, Eigen::VectorXd::Zero(count_)};
  ComplexStiffness g;
  for (const Node& node : nodes_) {
    if (spec_.fractional != Fractional::none) {
      stiffness_.fractional(over_time(node.powers), g);
    } else {
      g = stiffness_.at(node.log_s - log_t);
    }
    const auto [value, slope] = f(g.value);
    sum.value += (node.weight_over_s * value).real();
    const std::complex<double> factor = node.weight_over_s * slope;
    for (Eigen::Index i = 0; i < count_; ++i) {
      sum.by[i] += factor.real() * g.by[i].real() - factor.imag() * g.by[i].imag();
    }
  }
  return sum;
}

namespace {

struct WithSlope {
  std::complex<double> value, slope;
};

Error no_compliance(const LawSpec& spec) {
  return bad_input(fmt::format("law {}", law_name(spec)), "no stiffness, so no compliance",
                   "a stiffness above 0");
}

}  // namespace

SlopedNumber StepResponse::relaxation(double t_s) const {
  return inverse_over_s(t_s, [](std::complex<double> g) { return WithSlope{g, 1.0}; });
}

SlopedNumber StepResponse::creep_at_once() const {
  const std::optional<ComplexStiffness> g = stiffness_.instant();
  if (!g) return {0.0, Eigen::VectorXd::Zero(count_)};
  const double compliance = 1.0 / g->value.real();
  if (!std::isfinite(compliance)) throw no_compliance(spec_);
  return {compliance, -compliance * compliance * g->by.real().transpose()};
}

SlopedNumber StepResponse::creep(double t_s) const {
  SlopedNumber j = inverse_over_s(t_s, [](std::complex<double> g) {
    const std::complex<double> compliance = reciprocal(g);
    return WithSlope{compliance, -compliance * compliance};
  });
  if (std::isfinite(j.value)) return j;
  throw no_compliance(spec_);
}

}  // namespace tpm::law
