#pragma once
#include <array>
#include <vector>

#include "tpm/contact/servo_bonds.hpp"

namespace tpm::contact {

/// Where a contact is and was.
struct ZonePlace {
  double reach_m = 0.0;  ///< the larger of its depth and its viscous depth
  bool back = false;     ///< the viscous depth is the larger one
};

/// The error that linear surroundings of a zone cost, as a function of where the contact is and
/// was.
///
/// The viscous depth follows the depth as a viscous elongation follows an elongation (of several
/// branches the mean): after a release the surroundings still err as they did deeper. There are two
/// bounds, for a contact that is deeper than its viscous depth and for one that went back. Each is
/// the reach (ZonePlace) times a factor that is linear between even places from rest to a deepest
/// one, and grows in proportion to the distance from the normal. They are raised until they hold
/// the errors that were measured (require()).
class ZoneClaim {
 public:
  ZoneClaim() = default;
  /// @param deepest_m > 0; deeper places have the factor of this one
  explicit ZoneClaim(double deepest_m);

  /// By which the viscous depth follows, from rest on.
  void set_weights(const ServoWeights& weights);
  void reset() noexcept;
  /// Advances by a period to a depth.
  void advance(double depth_m) noexcept;
  [[nodiscard]] const ZonePlace& place() const noexcept { return place_; }
  /// The bound there, N.
  [[nodiscard]] double at(const ZonePlace& place, double aside_m) const noexcept;

  /// Raises the bound on the normal to an error at a place.
  void require(const ZonePlace& place, double error_N);
  /// Raises the growth across the normal to an error beside a place.
  void require_aside(const ZonePlace& place, double aside_m, double error_N);

 private:
  struct Branch {
    double share, keep, of_start, of_end;
    double viscous_m = 0.0;
  };
  double stride_m_ = 1.0;
  std::array<std::vector<double>, 2> bound_N_per_m_ = {std::vector<double>(2),
                                                       std::vector<double>(2)};
  double aside_N_per_m_ = 0.0;
  std::vector<Branch> branches_;
  double depth_m_ = 0.0;
  ZonePlace place_;
};

}  // namespace tpm::contact
