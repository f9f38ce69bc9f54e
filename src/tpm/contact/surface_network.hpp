#pragma once
#include <array>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/servo_stiffness.hpp"
#include "tpm/organ/balance/ball_on_network.hpp"
#include "tpmkit/contact_model.hpp"

namespace tpm::contact {

struct SurfaceNetworkOptions {
  double period_s = 1e-3;    ///< > 0
  double deepest_m = 10e-3;  ///< answers are not valid where a touched sphere is displaced more
  /// Forces are balanced once more while the error estimated is above this part of the largest
  /// force so far, up to `most_balances` times a step.
  double balance_again_above = 5e-4;
  int most_balances = 3;
  bool portable = false;  ///< without vector instructions beyond those of every processor
};

/// The whole quasi-static network under a ball that moves in space, stepped at servo rate (the
/// network of BallOnNetwork in single precision; docs/haptics.md, "Over the surface"). All spheres
/// are free; the ball touches any of those it may touch, several at once, and lets go of them.
///
/// A step moves the spheres by one solution with the stiffness at rest, factorised beforehand. The
/// forces of the ball are part of that solution: they are balanced by Newton's method against the
/// compliance of the touched spheres alone, kept from beforehand. The force answered is corrected
/// for what is left unbalanced afterwards, weighed with the fields of the touched spheres.
///
/// Its error estimate is by how much it had to be corrected, and what it costs to take elongations
/// as linear within a period: they curve about as the forces on the touched spheres do from period
/// to period, and what that leaves in the viscous state of the bonds fades as the contact relaxes.
class SurfaceNetwork final : public ContactModel {
 public:
  /// The most spheres touched, or nearly so, at a time.
  static constexpr int kMostTouched = 12;

  /// @param constraints of the tissue
  /// Throws Error(bad_input) for options out of range, bonds that do not have their rest length, a
  /// ball without radius or stiffness or one that has come into a sphere at its start,
  /// Error(numerical) for a tissue that is not stiff.
  SurfaceNetwork(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                 BallTool ball, const SurfaceNetworkOptions& options = {});

  void reset() noexcept override;
  /// @param displacement_m of the ball from its start
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return options_.period_s; }
  /// Against the sphere nearest to the ball's start, with the compliance of the overlap.
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return instantaneous_;
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return equilibrium_;
  }
  [[nodiscard]] Eigen::Index spheres() const noexcept override { return rest_.cols(); }
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override;

  /// Of the last step.
  [[nodiscard]] int touching() const noexcept;
  [[nodiscard]] int balances() const noexcept { return balances_; }
  /// The part of the last error estimate that is of elongations taken as linear.
  [[nodiscard]] double linear_error_N() const noexcept { return linear_error_N_; }

 private:
  /// A sphere that the ball may touch.
  struct SurfaceSphere {
    std::size_t column;        ///< of displacements
    Eigen::Vector3d rest_m;    ///< its centre at rest, from the ball's start
    const float* fields;       ///< its displacements per force on it, x, y and z; null: it is fixed
    Eigen::Vector3d pushed_N;  ///< with what the ball pushes it
    /// At the end of the last period, and its change in that.
    Eigen::Vector3d before_N = Eigen::Vector3d::Zero(), change_N = Eigen::Vector3d::Zero();
    /// Error so far of taking elongations as linear.
    Eigen::Vector3d linearisation_N = Eigen::Vector3d::Zero();
  };
  /// A sphere in reach of the ball while forces are balanced.
  struct Near {
    std::size_t candidate;
    Eigen::Vector3d free_m;    ///< from the ball to its centre, if the ball pushed nothing
    Eigen::Vector3d pushed_N;  ///< with what the ball pushes it
  };

  void add_surface();
  void find_stiffness(const BondSystem& bonds, const Constraints& constraints);
  [[nodiscard]] Eigen::Vector3d displacement_of(std::size_t column) const noexcept;
  [[nodiscard]] Eigen::Vector3d from_ball(const SurfaceSphere& candidate) const noexcept;
  /// Displacement of the first per force on the second.
  [[nodiscard]] Eigen::Matrix3d compliance(const SurfaceSphere& of,
                                           const SurfaceSphere& under) const noexcept;
  /// @param way_m how far the ball may come towards spheres
  void find_near(double way_m) noexcept;
  /// Balances the forces of the ball against the compliance of the spheres near it.
  void press() noexcept;
  /// Solves for the part of the forces that starts at `first`, and moves the spheres.
  void balance(std::size_t first, double way_m) noexcept;
  /// The displacement that forces in `change_` give a sphere with these fields.
  [[nodiscard]] Eigen::Vector3d weighed(const float* fields) const noexcept;
  void answer() noexcept;
  /// Adds to the answer what a period with linear elongations has cost.
  void add_linear_error() noexcept;
  [[nodiscard]] double scale_N() const noexcept;
  [[nodiscard]] bool has_fallen_in() const noexcept;
  [[nodiscard]] Eigen::Vector3d total_N() const noexcept;

  SurfaceNetworkOptions options_;
  BallTool ball_;
  Positions rest_;
  ServoWeights weights_;
  ServoStiffness stiffness_;
  ServoBonds bonds_;
  AlignedFloats fields_;  ///< of all skin, three each
  std::size_t stride_ = 0;
  std::vector<SurfaceSphere> surface_;
  std::vector<std::size_t> inside_;  ///< spheres that it is not to touch
  Eigen::Matrix3d instantaneous_, equilibrium_;

  AlignedFloats displacement_, force_, change_;
  std::array<Near, kMostTouched> near_{};
  int near_count_ = 0;
  bool too_many_ = false, pressed_ = true;
  Eigen::Vector3d ball_at_ = Eigen::Vector3d::Zero();  ///< from its start
  Eigen::Vector3d moved_with_N_ = Eigen::Vector3d::Zero();
  ContactAnswer answer_;
  double bend_ = 0.0, bend_kept_ = 0.0;  ///< of a change of the change of a force; a period later
  double largest_N_ = 0.0, held_error_N_ = 0.0, linear_error_N_ = 0.0;
  int balances_ = 0;
};

}  // namespace tpm::contact
