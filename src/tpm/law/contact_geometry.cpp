#include "tpm/law/contact_geometry.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

/// Depth over radius up to which Hertz's parabola stands for a sphere.
constexpr double kShallow = 0.1;

void require_valid(const ContactGeometry& g) {
  const auto refuse = [](std::string_view what, std::string_view expected) {
    throw bad_input("geometry", what, expected);
  };
  for (const auto& size : {g.sphere_radius_m, g.punch_radius_m, g.area_m2, g.length_m}) {
    if (size && !(*size > 0.0 && std::isfinite(*size))) {
      refuse(fmt::format("a size of {}", shortest(*size)), "sizes above 0");
    }
  }
  if (g.cone_half_angle_rad &&
      !(*g.cone_half_angle_rad > 0.0 && *g.cone_half_angle_rad < 0.5 * std::numbers::pi)) {
    refuse(fmt::format("a half angle of {} rad", shortest(*g.cone_half_angle_rad)),
           "an angle between the axis and the surface, above 0 and below 90 deg");
  }
  if (!(g.poisson_ratio >= 0.0 && g.poisson_ratio <= 0.5)) {
    refuse(fmt::format("Poisson's ratio {}", shortest(g.poisson_ratio)), "0 to 0.5");
  }
  if (g.area_m2.has_value() != g.length_m.has_value()) {
    refuse("an area without a length, or a length without an area", "both");
  }
  const int probes = (g.sphere_radius_m ? 1 : 0) + (g.cone_half_angle_rad ? 1 : 0) +
                     (g.punch_radius_m ? 1 : 0) + (g.area_m2 ? 1 : 0);
  if (probes > 1) refuse("a radius and an area, or two probes", "one of them");
}

double degrees(double rad) {
  return rad * 180.0 / std::numbers::pi;
}

}  // namespace

std::optional<double> modulus_Pa(const LawSpec& spec, double stiffness,
                                 const ContactGeometry& geometry) {
  require_valid(geometry);
  const double nu = geometry.poisson_ratio;
  if (spec.response == Quantity::stress) return stiffness;
  if (geometry.area_m2) return stiffness * *geometry.length_m / *geometry.area_m2;
  const double lateral = (1.0 - nu) * (1.0 + nu);
  if (geometry.sphere_radius_m) {
    return 0.75 * stiffness * lateral / std::sqrt(*geometry.sphere_radius_m * spec.reference);
  }
  if (geometry.cone_half_angle_rad) {
    return 0.5 * std::numbers::pi * stiffness * lateral /
           (std::tan(*geometry.cone_half_angle_rad) * spec.reference);
  }
  if (geometry.punch_radius_m) return 0.5 * stiffness * lateral / *geometry.punch_radius_m;
  return std::nullopt;
}

std::string geometry_words(const ContactGeometry& g) {
  const auto mm = [](double m) { return significant(1e3 * m, 6); };
  if (g.sphere_radius_m) {
    return fmt::format("a sphere of radius {} mm, F = 4/3 E/(1 - nu^2) sqrt(R) u^(3/2) (Hertz)",
                       mm(*g.sphere_radius_m));
  }
  if (g.cone_half_angle_rad) {
    return fmt::format(
        "a cone whose surface stands {} deg off its axis, F = 2/pi E/(1 - nu^2) tan(a) u^2 "
        "(Sneddon)",
        significant(degrees(*g.cone_half_angle_rad), 6));
  }
  if (g.punch_radius_m) {
    return fmt::format("a flat punch of radius {} mm, F = 2 E/(1 - nu^2) r u (Sneddon)",
                       mm(*g.punch_radius_m));
  }
  if (g.area_m2) {
    return fmt::format("a bar of {} mm^2 and {} mm, F = E A/l u", significant(1e6 * *g.area_m2, 6),
                       mm(g.length_m.value()));
  }
  return {};
}

std::vector<Remark> geometry_remarks(const LawSpec& spec, const ContactGeometry& g,
                                     std::optional<double> depth_m) {
  std::vector<Remark> remarks;
  if (spec.response == Quantity::stress) return remarks;
  if (g.sphere_radius_m) {
    const double deepest = depth_m.value_or(spec.reference);
    const double share = deepest / *g.sphere_radius_m;
    if (share > kShallow) {
      remarks.push_back(
          {"deep_for_sphere",
           fmt::format("the depth of {} mm is {} of the sphere's radius ({} mm){}: Hertz's formula "
                       "holds for "
                       "depths well below it (up to {})",
                       significant(1e3 * deepest, 3), significant(share, 3),
                       significant(1e3 * *g.sphere_radius_m, 6),
                       share >= 1.0 ? ", so the whole half sphere is under the surface" : "",
                       significant(kShallow, 2))});
    }
  }
  const Kernel wanted = g.sphere_radius_m       ? Kernel::hertz
                        : g.cone_half_angle_rad ? Kernel::power
                                                : Kernel::linear;
  if (g.is_given() && spec.kernel != wanted) {
    remarks.push_back(
        {"kernel_not_of_probe", fmt::format("the kernel of {} is not that of the probe: the moduli "
                                            "are right at the reference depth of "
                                            "{} mm alone",
                                            law_name(spec), significant(1e3 * spec.reference, 4))});
  }
  return remarks;
}

}  // namespace tpm::law
