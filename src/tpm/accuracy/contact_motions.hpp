#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tpmkit/protocol.hpp"

namespace tpm::accuracy {

/// Where a contact sphere goes at a servo rate, beginning at rest; between two periods it moves
/// linearly.
struct ContactMotion {
  std::string name;
  double period_s = 1e-3;
  Eigen::Matrix3Xd displacement_m;  ///< at the end of each period, in the organ's coordinates
  /// The same along one line through rest, if it is one: a history of depths along `direction`,
  /// whose knots lie at ends of periods.
  std::optional<Protocol> line = std::nullopt;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();

  [[nodiscard]] Eigen::Index steps() const { return displacement_m.cols(); }
};

/// The directions in which a contact is pushed: into the tissue, and two across.
struct ContactAxes {
  Eigen::Vector3d into, first, second;
};
/// @param into unit vector
[[nodiscard]] ContactAxes contact_axes(const Eigen::Vector3d& into);

/// From rest to a depth at a speed, then held. Knots are rounded to whole periods, so the speed is
/// near what is asked for.
/// @param direction unit vector
[[nodiscard]] ContactMotion ramp_motion(const Eigen::Vector3d& direction, double depth_m,
                                        double speed_m_per_s, double hold_s, double period_s);

/// From rest to a depth at a speed, held, back at that speed, and held as long at rest.
/// @param direction unit vector
[[nodiscard]] ContactMotion poke_motion(const Eigen::Vector3d& direction, double depth_m,
                                        double speed_m_per_s, double hold_s, double period_s);

/// To random depths from 0 to `deepest_m` at random speeds, evenly spread over the logarithm from
/// 1 to 100 mm/s, now and then held for up to 0.1 s.
[[nodiscard]] ContactMotion random_motion(const Eigen::Vector3d& direction, double deepest_m,
                                          double duration_s, std::uint64_t seed, double period_s);

/// Pressed to a depth at 20 mm/s, moved sideways to `aside_m` at a speed, held for 0.1 s, and
/// moved back through the middle to the other side.
[[nodiscard]] ContactMotion sideways_motion(const ContactAxes& axes, double depth_m, double aside_m,
                                            double speed_m_per_s, double period_s);

/// Pressed to a depth at 20 mm/s, moved sideways to the radius at 50 mm/s, then in circles.
[[nodiscard]] ContactMotion circling_motion(const ContactAxes& axes, double depth_m,
                                            double radius_m, double turns_per_s, double turns,
                                            double period_s);

/// Random depths (0 to `deepest_m`) and random places within `aside_m` sideways, at random speeds
/// from 1 to 100 mm/s, with circles now and then.
[[nodiscard]] ContactMotion random_motion_in_space(const ContactAxes& axes, double deepest_m,
                                                   double aside_m, Eigen::Index steps,
                                                   std::uint64_t seed, double period_s);

/// The same way in shorter periods: straight within each of the motion's own.
/// @param pieces of each period, >= 1
[[nodiscard]] ContactMotion refined(ContactMotion motion, int pieces);

}  // namespace tpm::accuracy
