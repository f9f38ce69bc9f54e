#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpmkit/law.hpp"

namespace tpm::law {

/// The geometry by which a stiffness in N/m becomes Young's modulus E in Pa: the rigid probe that
/// was pressed into a half space, or a bar. nu is Poisson's ratio, u_ref the law's reference depth.
///
/// | probe      | force                                        | law                   |
/// | sphere     | F = 4/3 E/(1 - nu^2) sqrt(R) u^(3/2) (Hertz) | hertz                 |
/// | cone       | F = 2/pi E/(1 - nu^2) tan(a) u^2 (Sneddon)   | power with exponent 2 |
/// | flat punch | F = 2 E/(1 - nu^2) r u (Sneddon)             | linear                |
/// | bar        | F = E A/l u                                  | linear                |
///
/// Sneddon, Int. J. Engng Sci. 3 (1965) 47. A law with another kernel is taken at u_ref alone.
struct ContactGeometry {
  std::optional<double> sphere_radius_m;
  std::optional<double> cone_half_angle_rad;  ///< between the cone's axis and its surface
  std::optional<double> punch_radius_m;
  std::optional<double> area_m2;  ///< of a bar; together with length_m
  std::optional<double> length_m;
  double poisson_ratio = 0.49;  ///< assumed; 0 to 0.5

  [[nodiscard]] bool is_given() const {
    return sphere_radius_m || cone_half_angle_rad || punch_radius_m || area_m2 || length_m;
  }
};

/// E (Pa) of a stiffness at the reference depth; none if the geometry is not given. The stiffness
/// of a law of stress is a modulus already. Throws Error(bad_input) for sizes that are not above 0,
/// an angle outside 0 to 90 degrees, more than one probe, half of a bar, and Poisson's ratios
/// outside 0 to 0.5.
[[nodiscard]] std::optional<double> modulus_Pa(const LawSpec& spec, double stiffness,
                                               const ContactGeometry& geometry);

/// "a sphere of radius 2 mm, F = 4/3 E/(1 - nu^2) sqrt(R) u^(3/2) (Hertz)"; empty if not given.
[[nodiscard]] std::string geometry_words(const ContactGeometry& geometry);

/// Remarks for a reader of moduli of that geometry: a depth that is not small beside
/// the sphere, a kernel that is not the probe's.
/// @param depth_m largest depth that the law was fitted to, from contact on; the law's reference
///   depth if it is not known
[[nodiscard]] std::vector<Remark> geometry_remarks(const LawSpec& spec,
                                                   const ContactGeometry& geometry,
                                                   std::optional<double> depth_m);

}  // namespace tpm::law
