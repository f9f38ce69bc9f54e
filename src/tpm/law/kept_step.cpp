#include "tpm/law/kept_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/law/relaxation.hpp"
#include "tpm/law/tension_creep.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

/// The value of a step that is imposed at the first knot and kept; nothing for other histories.
std::optional<double> kept_step(const Protocol& protocol) {
  const auto knots = protocol.knots();
  const double value = knots.front().value;
  const bool kept =
      !protocol.equilibrium_at_start() &&
      std::all_of(knots.begin(), knots.end(), [value](const Knot& k) { return k.value == value; });
  return kept ? std::optional(value) : std::nullopt;
}

bool has_stiffness(const std::vector<LawParameter>& table, std::span<const double> values) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    const Dimension dimension = table[i].dimension;
    const bool stiffness = dimension == Dimension::stiffness || dimension == Dimension::stress;
    if (stiffness && !table[i].nuisance && values[i] > 0.0) return true;
  }
  return false;
}

}  // namespace

KernelAtParameters kernel_at(const LawSpec& spec, const std::vector<LawParameter>& table,
                             std::span<const double> values) {
  const auto get = [&](std::string_view name, double otherwise, int& place) {
    for (std::size_t i = 0; i < table.size(); ++i) {
      if (table[i].name != name) continue;
      place = static_cast<int>(i);
      return values[i];
    }
    return otherwise;
  };
  KernelPlaces place;
  const double exponent = get("exponent", 1.0, place.exponent);
  const double share = get("tension_share", 0.0, place.tension_share);
  const double k_tension = get("k_tension", 0.0, place.k_tension);
  const double spacing = get("spacing", std::numeric_limits<double>::infinity(), place.spacing);
  const double contact = get("contact", 0.0, place.contact);
  const double offset = get("offset", 0.0, place.offset);
  return {place,
          k_tension,
          spacing,
          contact,
          offset,
          KernelShape(spec.kernel, spec.reference, exponent,
                      place.tension_share < 0 ? std::nullopt : std::optional(share), spacing)};
}

std::optional<Response> respond_to_kept_load(const LawAtParameters& law, const Protocol& protocol,
                                             std::span<const double> times_s, Want want) {
  const auto load = kept_step(protocol);
  if (protocol.drive() != Drive::force || !load) return std::nullopt;
  std::vector<double> since;
  since.reserve(times_s.size());
  for (const double t : times_s) since.push_back(t - protocol.start_s());
  return creep_with_tension(law, *load, since, want);
}

std::optional<Response> respond_to_step(const LawSpec& spec, const std::vector<LawParameter>& table,
                                        std::span<const double> parameters,
                                        const Protocol& protocol, std::span<const double> times_s,
                                        Want want) {
  const bool depth = protocol.drive() == Drive::displacement;
  const bool curved = spec.kernel != Kernel::linear || spec.tension != Tension::none;
  const auto value = kept_step(protocol);
  if (spec.fractional == Fractional::none || spec.tension == Tension::elastic ||
      (curved && depth) || !value) {
    return std::nullopt;
  }
  const double start = protocol.start_s();
  if (!std::all_of(times_s.begin(), times_s.end(), [=](double t) {
        return (depth ? t > start : t >= start) && std::isfinite(t);
      })) {
    return std::nullopt;
  }
  if (!depth && !has_stiffness(table, parameters)) {
    throw Error(ExitCode::numerical, "law", "nothing carries the load");
  }
  const KernelAtParameters at = kernel_at(spec, table, parameters);
  const double step = *value - (depth ? at.contact : at.offset);
  if (!(step > 0.0)) return std::nullopt;
  const auto n = std::ssize(parameters);
  const int moved = depth ? at.place.contact : at.place.offset;  // what the step is counted from
  const int added = depth ? at.place.offset : at.place.contact;
  Response response;
  response.value.resize(std::ssize(times_s));
  const bool want_slopes = want == Want::values_and_sensitivity;
  if (want_slopes) response.sensitivity.resize(std::ssize(times_s), n);
  const StepResponse function(spec, parameters);
  for (Eigen::Index i = 0; i < response.value.size(); ++i) {
    const double since = times_s[static_cast<std::size_t>(i)] - start;
    const SlopedNumber f = depth         ? function.relaxation(since)
                           : since > 0.0 ? function.creep(since)
                                         : function.creep_at_once();
    const double v = step * f.value;  // a force, or V(u)
    const double u = depth ? v : at.kernel.inverse(v);
    response.value[i] = (depth ? at.offset : at.contact) + u;
    if (!want_slopes) continue;
    Eigen::VectorXd by = step * f.by;
    by[moved] -= f.value;
    if (!depth && v == 0.0) {
      by.setZero();  // nothing has moved yet, whatever the kernel
    } else if (!depth) {
      const KernelShape::Values k = at.kernel.at(u);
      if (at.place.exponent >= 0) by[at.place.exponent] -= k.d_exponent;
      if (at.place.tension_share >= 0) {
        by[at.place.tension_share] -= k.d_share;
        by[at.place.spacing] -= k.d_spacing;
      }
      by /= k.slope;
    }
    by[added] += 1.0;
    response.sensitivity.row(i) = by.transpose();
  }
  return response;
}

}  // namespace tpm::law
