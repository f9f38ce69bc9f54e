#pragma once
#include <optional>

#include "tpm/organ/bonds/roughness.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"

namespace tpm::organ {

/// Roughness of a deformation (organ/bonds/roughness.hpp), where the paper's Fig. 3 is looked at.
struct Smoothness {
  double near_contact = 0.0;     ///< of the spheres that two lateral bonds reach from the probe's
  std::optional<double> at_rim;  ///< of the free spheres at sharp edges of the outer layer, if any
  std::size_t near_spheres = 0, rim_spheres = 0;
};

inline constexpr int kNearSteps = 2;
inline constexpr double kRimAngle_rad = 0.43633231299858238;  ///< 25 degrees

/// Finds the spheres to look at once, for the deformations of a run.
class SmoothnessProbe {
 public:
  /// @param scene must live as long as this
  explicit SmoothnessProbe(const ExperimentScene& scene);
  /// None if nothing has moved.
  /// @param position of the organ's spheres, m
  [[nodiscard]] std::optional<Smoothness> at(const Positions& position) const;

 private:
  SmoothnessProbe(const Network& network, const std::vector<std::size_t>& near,
                  const std::vector<std::size_t>& rim);

  const Network& network_;
  std::size_t near_spheres_, rim_spheres_;
  Unevenness near_, rim_;
};

/// Of one deformation: SmoothnessProbe(scene).at(position).
[[nodiscard]] std::optional<Smoothness> smoothness_of(const ExperimentScene& scene,
                                                      const Positions& position);

}  // namespace tpm::organ
