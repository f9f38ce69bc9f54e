#pragma once
#include <cstdint>
#include <vector>

#include "tpm/law/element/validity_limits.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/simulation.hpp"

namespace tpm::organ {

/// True for the paper's element and for a liver of a size like the paper's: 10 and 12 mm are depths
/// of such a liver. They say nothing about an organ of another shape or size.
[[nodiscard]] bool depth_limits_apply(const Tissue& tissue);

/// Compares the positions of a network with the limits. The indentation of a sphere is its
/// displacement along the probe's direction.
class ValidityWatch {
 public:
  /// @param scene its network must live as long as this
  explicit ValidityWatch(const ExperimentScene& scene);

  /// For each sphere the sum of 1 (indentation), 2 (damage) and 4 (an end of a turned bond).
  [[nodiscard]] std::vector<std::int32_t> flags(const Positions& position) const;
  /// Takes one more state into account; times do not fall.
  void see(double time_s, const Positions& position);
  [[nodiscard]] const Validity& seen() const { return seen_; }
  /// Goes on from what an earlier run has seen.
  void restore(Validity earlier) { seen_ = std::move(earlier); }

 private:
  /// The same.
  /// @param deepest_m, most_turned_rad an indentation and an angle; afterwards the largest of them
  ///   and of all spheres and lateral bonds
  [[nodiscard]] std::vector<std::int32_t> flags(const Positions& position, double& deepest_m,
                                                double& most_turned_rad) const;
  /// A bond that turns.
  struct Lateral {
    std::size_t a, b;
    double length_m;  ///< at rest
  };

  const Positions& rest_;
  Eigen::Vector3d direction_;  ///< of the probe
  bool depth_limits_;          ///< the limits of depth apply (depth_limits_apply)
  std::vector<Lateral> lateral_;
  Validity seen_;
};

}  // namespace tpm::organ
