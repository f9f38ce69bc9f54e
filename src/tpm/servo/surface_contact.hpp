#pragma once
#include <memory>
#include <vector>

#include "tpm/servo/one_sided_contact.hpp"

namespace tpm {

/// A sphere of an organ's surface that a tool can meet.
struct SurfacePlace {
  Eigen::Vector3d rest_m;               ///< its centre at rest
  Eigen::Vector3d into;                 ///< into the tissue, unit vector
  std::unique_ptr<ContactModel> model;  ///< null: there is surface, and nobody answers for it
};

struct SurfaceContactOptions {
  double tool_radius_m = 0.0;    ///< of a ball; 0: a point
  double sphere_radius_m = 0.0;  ///< of the organ's spheres
  double reach_m = 0.0;          ///< how far aside a place is felt: the distance of neighbours, > 0
};

/// A tool without friction on an organ's surface, free to move in space: on and off, and sliding
/// from place to place (docs/haptics.md, "Over the surface").
///
/// Place i sees the tool at the depth D_i = a_i d_i below it, one-sided as OneSidedContact; d_i is
/// the depth below the tangent plane that the tool's ball touches at rest, and a_i(p) its share,
/// with sum a_i^2 = 1 over the surface. The tool feels F = -sum f_i dD_i/dp, so that its power is
/// to the last digit that of the places, sum f_i dD_i/dt: what is passive place by place is passive
/// together, whatever the shares. That the squares of the shares add up to 1 makes a surface of
/// equal linear places equally stiff everywhere, and without force aside.
///
/// A step neither allocates nor throws.
class SurfaceContact {
 public:
  struct Answer {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< of the tissue on the tool
    double depth_m = 0.0;  ///< of the tool below the surface at rest, share by share; < 0: in air
    int touching = 0;      ///< places
    int awake = 0;         ///< places stepped: touched, or not yet back at rest
    double error_N = 0.0;  ///< sum of the models' estimates
    bool trusted = true;   ///< false over places that nobody answers for and past the edge
  };

  /// Throws Error(bad_input) for no place with a model or a reach that is not above 0.
  SurfaceContact(std::vector<SurfacePlace> places, const SurfaceContactOptions& options);

  void reset() noexcept;
  /// One period. @param tool_m centre of the tool's ball at its end, moving linearly
  Answer step(const Eigen::Vector3d& tool_m) noexcept;
  [[nodiscard]] std::size_t places() const noexcept { return places_.size(); }
  /// At which a place saw the tool in the last step.
  [[nodiscard]] double depth_m(std::size_t place) const noexcept { return places_[place].depth_m; }

 private:
  struct Place {
    Eigen::Vector3d rest_m, into;
    std::unique_ptr<ContactModel> model;
    std::unique_ptr<OneSidedContact> contact;
    bool awake = false;
    double weight = 0.0, depth_m = 0.0;
    Eigen::Vector3d weight_slope = Eigen::Vector3d::Zero();
  };
  /// The weights at a place of the tool; returns what the sum of their squares is divided by.
  double weigh(const Eigen::Vector3d& tool_m, Eigen::Vector3d& slope) noexcept;

  SurfaceContactOptions options_;
  std::vector<Place> places_;
  bool past_edge_ = false;
};

}  // namespace tpm
