#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/bonds/bond_system.hpp"

namespace tpm::contact {

/// Weights of the exact update of one branch over a servo period in which elongations are linear:
/// m_new = keep m + of_start l_old + of_end l_new.
struct ServoBranch {
  float share = 1.0F;  ///< gamma of the branch
  float keep = 0.0F, of_start = 0.0F, of_end = 0.0F;
};

/// The same for the mean viscous elongation y = sum of share m: of_start and of_end are means over
/// the branches; with several the part of the start follows from every branch.
struct ServoWeights {
  float keep = 0.0F;  ///< of one branch
  float of_start = 0.0F, of_end = 0.0F;
  std::vector<ServoBranch> branches;  ///< where there are several

  [[nodiscard]] float longest_kept() const;  ///< the largest keep
};

/// Operation count of one force evaluation; used to predict the cost of a step.
struct BalanceWork {
  std::size_t bonds = 0;     ///< in all lanes, filled up ones too
  std::size_t blocks = 0;    ///< 3x3 blocks of a FrontalFactor that a solution reads
  std::size_t products = 0;  ///< multiplications of dense panels and vectors
};

/// Weights of the bonds that relax, which do so by one function of time.
/// @param period_s > 0
[[nodiscard]] ServoWeights servo_weights(const BondSystem& bonds, double period_s);

/// Refuses what models at servo rate do not take. Throws Error(bad_input) that names the
/// formulations that do, unless all bonds that relax do so by one function of time (any number of
/// branches, linear in elongation) and potentials are linear or cubic.
void require_servo_material(const BondSystem& bonds, std::string_view who);

/// Bonds of a network in single precision, eight side by side, with their viscous elongations at
/// the end of the next period if nothing moves apart from its own end. The vector from one end to
/// the other is kept as that at rest and a small displacement, so that elongations lose no digits.
/// A bond pulls with N = (k + c l^2) l - g y, c of its cubic potential.
///
/// Displacements have four floats per sphere and forces eight: the first four are what bonds pull
/// with now, the other four what they will pull with at the end of the next period if nothing
/// moves. The fourth of each four has no meaning. One sphere more than there are takes what fills
/// up the lanes.
class ServoBonds {
 public:
  static constexpr std::size_t kWide = 8;

  /// A bond of the system, and where its ends stand.
  struct Choice {
    std::size_t bond;    ///< of the system
    std::uint32_t a, b;  ///< columns of displacements
  };

  ServoBonds() = default;
  /// @param rest m, of the system's spheres
  /// @param filler column that takes what fills up the lanes
  ServoBonds(const BondSystem& bonds, const Positions& rest, std::span<const Choice> chosen,
             std::uint32_t filler, bool portable = false);

  /// All viscous elongations become 0, as at rest.
  void forget() noexcept;

  /// Adds what bonds pull with under displacements, now and at the end of the next period. The
  /// viscous elongations move on with accept().
  void advance(const float* displacement, const ServoWeights& weights, float* force) noexcept;
  /// The same, now only.
  void advance_now(const float* displacement, const ServoWeights& weights, float* force) noexcept;
  /// A period is over, as it was advanced last.
  void accept() noexcept { latest_ = 1 - latest_; }
  /// Adds what bonds will pull with at the end of the next period, to the other four.
  void add_next(const float* displacement, const ServoWeights& weights, float* force) noexcept;

  [[nodiscard]] std::size_t groups() const { return group_.size(); }

 private:
  struct alignas(32) Group {
    using Lane = std::array<float, kWide>;
    Lane x, y, z;  ///< at rest, m
    Lane rest;     ///< length, m
    Lane k, g;     ///< N/m
    Lane cubic;    ///< c, N/m^3
    Lane least;    ///< elongation below which the bond is slack, m
    /// y at the end of the next period less its part that follows, m: that in use, and the next.
    std::array<Lane, 2> offset;
    std::array<std::uint32_t, kWide> a, b;  ///< where displacements of the ends begin
  };
  friend struct ServoBondKernels;

  /// The offset of one branch of a group, where there are several.
  struct alignas(32) BranchLane {
    std::array<Group::Lane, 2> offset;
  };

  std::vector<Group> group_;
  std::size_t branches_ = 1;
  std::vector<BranchLane> branch_;  ///< group by group
  std::size_t latest_ = 0;          ///< of each group's offsets
  bool vectors_ = false;
  bool cubic_ = false;
};

}  // namespace tpm::contact
