#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/organ/scene/scene_keys.hpp"

namespace tpm::organ {

/// One body filled with more or fewer spheres: the scenes of a study of convergence.
///
/// Forces have a limit for smaller spheres under the spacing law `continuum` alone, and where what
/// presses has a size of its own. Contacts keep their place and direction; a shell keeps its
/// thickness, by the number of its layers.
class RefilledScene {
 public:
  /// @param document a scene that parse_experiment accepts
  /// @param where, folder as in parse_experiment
  /// Throws Error(bad_input) with the key of what has no limit or names spheres by their numbers.
  RefilledScene(Json document, std::string where, std::filesystem::path folder);

  /// A filling: its spacing is the scene's over `finer`.
  struct Filling {
    double finer = 1.0;
    std::size_t spheres = 0;  ///< of a block about
  };
  /// All with so many spheres, by rising number.
  [[nodiscard]] std::vector<Filling> fillings(std::size_t fewest, std::size_t most) const;

  /// The scene as a document.
  [[nodiscard]] Json document(const Filling& filling) const;
  /// Throws Error(bad_input) for a network that does not stand, as parse_experiment does.
  [[nodiscard]] ExperimentScene scene(const Filling& filling) const;
  /// As stated.
  [[nodiscard]] const ExperimentScene& own() const { return own_; }

 private:
  [[nodiscard]] std::optional<std::pair<Json, std::size_t>> refilled(double finer) const;

  std::string where_;
  Json document_;
  std::filesystem::path folder_;
  SceneKeys keys_;
  ExperimentScene own_;
};

}  // namespace tpm::organ
