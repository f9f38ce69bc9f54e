#include "tpm/fit/likelihood/parameter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

std::string_view scale_name(Scale scale) noexcept {
  return entry_of(kScaleWords, scale).text;
}

double FitParameter::theta(double p) const {
  switch (scale) {
    case Scale::log:
      return std::log(p);
    case Scale::linear:
      return p;
    case Scale::inverse_square:
      return (lower / p) * (lower / p);
  }
  return p;
}

double FitParameter::natural(double t) const {
  switch (scale) {
    case Scale::log:
      return std::exp(t);
    case Scale::linear:
      return t;
    case Scale::inverse_square:
      return lower / std::sqrt(t);
  }
  return t;
}

double FitParameter::natural_slope(double t) const {
  switch (scale) {
    case Scale::log:
      return std::exp(t);
    case Scale::linear:
      return 1.0;
    case Scale::inverse_square:
      return -0.5 * lower / (t * std::sqrt(t));
  }
  return 1.0;
}

double FitParameter::theta_lower() const {
  return reversed() ? theta(upper) : theta(lower);
}
double FitParameter::theta_upper() const {
  return reversed() ? theta(lower) : theta(upper);
}

namespace {
bool close_in_theta(const FitParameter& p, double natural, double bound) {
  if (!std::isfinite(bound)) return false;
  const double width = p.theta_upper() - p.theta_lower();
  const double scale = std::isfinite(width) ? width : 1.0;
  return std::abs(p.theta(natural) - p.theta(bound)) <= 1e-9 * scale;
}
}  // namespace

bool FitParameter::at_lower(double p) const {
  return close_in_theta(*this, p, lower);
}
bool FitParameter::at_upper(double p) const {
  return close_in_theta(*this, p, upper);
}

Unit per_second(const Unit& unit) {
  return {unit.symbol + "/s", unit.dimension, unit.to_si};
}

std::string si_unit(const FitParameter& parameter) {
  const Dimension dimension = parameter.unit.dimension;
  const std::string symbol(si_symbol(dimension));
  const bool drift = dimension != Dimension::speed && parameter.unit.symbol.ends_with("/s");
  return drift ? symbol + "/s" : symbol;
}

std::vector<double> start_values(std::span<const FitParameter> parameters) {
  return mapped<double>(parameters, &FitParameter::start);
}

void require_valid(const FitParameter& p, std::string_view where) {
  const std::string place = fmt::format("{}: parameter '{}'", where, p.name);
  if (p.scale != Scale::linear && !(p.lower > 0.0 && std::isfinite(p.upper))) {
    throw bad_input(place,
                    fmt::format("bounds {} to {} (SI) on the {} scale", shortest(p.lower),
                                shortest(p.upper), scale_name(p.scale)),
                    "finite bounds above 0, or the linear scale");
  }
  if (!(p.lower < p.upper)) {
    throw bad_input(place,
                    fmt::format("lower bound {} is not below upper bound {} (SI)",
                                shortest(p.lower), shortest(p.upper)),
                    "lower < upper");
  }
  if (!(p.start >= p.lower && p.start <= p.upper)) {
    throw bad_input(place, fmt::format("start {} (SI) is outside the bounds", shortest(p.start)),
                    fmt::format("{} to {}", shortest(p.lower), shortest(p.upper)));
  }
}

std::vector<double> moved_within_bounds(std::span<const FitParameter> parameters,
                                        const std::vector<std::size_t>& free,
                                        std::span<const double> natural,
                                        const Eigen::VectorXd& by) {
  const auto step = [&](Eigen::Index k) {
    const std::size_t i = free[static_cast<std::size_t>(k)];
    return by[k] / parameters[i].natural_slope(parameters[i].theta(natural[i]));
  };
  double share = 1.0;
  for (Eigen::Index k = 0; k < by.size(); ++k) {
    const std::size_t i = free[static_cast<std::size_t>(k)];
    const FitParameter& p = parameters[i];
    const double at = p.theta(natural[i]);
    const double room = step(k) > 0.0 ? p.theta_upper() - at : at - p.theta_lower();
    if (share * std::abs(step(k)) > room) share = room / std::abs(step(k));
  }
  std::vector<double> moved(natural.begin(), natural.end());
  for (Eigen::Index k = 0; k < by.size(); ++k) {
    const std::size_t i = free[static_cast<std::size_t>(k)];
    const FitParameter& p = parameters[i];
    // The longest share ends on a bound, which its rounding may pass.
    moved[i] = std::clamp(p.natural(p.theta(natural[i]) + share * step(k)), p.lower, p.upper);
  }
  return moved;
}

}  // namespace tpm::fit
