#include "tpm/contact/stored_energy.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::contact {
namespace {

double value_or(const LawFile& law, std::string_view name, double otherwise) {
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].name == name) return law.values[i];
  }
  return otherwise;
}

double exponent_of(const LawFile& law) {
  if (law.spec.kernel == Kernel::linear) return 1.0;
  constexpr double kHertz = 1.5;
  return law.spec.kernel == Kernel::hertz ? kHertz : value_or(law, "exponent", 1.0);
}

std::optional<double> share_of(const LawFile& law) {
  if (law.spec.tension != Tension::relaxing) return std::nullopt;
  return value_or(law, "tension_share", 0.0);
}

double spacing_of(const LawFile& law) {
  return value_or(law, "spacing", std::numeric_limits<double>::infinity());
}

double odd(double u, double at_size) {
  return u < 0.0 ? -at_size : at_size;
}

}  // namespace

StoredEnergy::StoredEnergy(const LawFile& law)
    : spec_(law.spec),
      shape_(law.spec.kernel, law.spec.reference, exponent_of(law), share_of(law), spacing_of(law)),
      tension_{law.spec.reference, spacing_of(law)},
      exponent_(exponent_of(law)),
      share_(share_of(law).value_or(0.0)),
      k_inf_(value_or(law, "k_inf", 0.0)),
      k_tension_(value_or(law, "k_tension", 0.0)),
      relaxing_(0.0) {
  if (spec_.fractional != Fractional::none || spec_.form == BranchForm::series) {
    throw bad_input("law " + law_name(spec_), "has no energy that is known here",
                    "branches in parallel");
  }
  for (int i = 1; i <= spec_.branches; ++i) {
    relaxing_ += value_or(law, fmt::format("k{}", i), 0.0);
  }
}

double StoredEnergy::tension_potential(double u) const {
  // T = u phi(u)/phi(u_ref) with phi = u^2 y^2/(q (q + 1)), q = sqrt(1 + u^2 y^2), y = 1/x; its
  // integral without cancellation, regular at y = 0.
  const double y = 1.0 / tension_.spacing, r = tension_.reference;
  const double q_u = std::sqrt(1.0 + u * u * y * y), q_r = std::sqrt(1.0 + r * r * y * y);
  const double ratio = u / r;
  return u * u * ratio * ratio * q_r * (q_r + 1.0) / (2.0 * (q_u + 1.0) * (q_u + 1.0));
}

double StoredEnergy::potential(double u) const {
  const double r = spec_.reference, size = std::abs(u);
  double p = 0.5 * size * size;
  if (exponent_ != 1.0) p = r * r * std::pow(size / r, exponent_ + 1.0) / (exponent_ + 1.0);
  return share_ == 0.0 ? p : (1.0 - share_) * p + share_ * tension_potential(size);
}

double StoredEnergy::conjugate(double v) const {
  const double u = shape_.inverse(std::abs(v));
  return u * std::abs(v) - potential(u);
}

double StoredEnergy::branch(double u, double v) const {
  return potential(u) + conjugate(v) - u * v;
}

double StoredEnergy::kernel(double u) const {
  return odd(u, shape_.value(std::abs(u)));
}

double StoredEnergy::lasting_force(double u) const {
  double force = k_inf_ * kernel(u);
  if (k_tension_ != 0.0) force += k_tension_ * odd(u, tension_.at(std::abs(u)).value);
  return force;
}

double StoredEnergy::lasting(double u) const {
  double energy = k_inf_ * potential(u);
  if (k_tension_ != 0.0) energy += k_tension_ * tension_potential(u);
  return energy;
}

}  // namespace tpm::contact
