#pragma once
// A scene as its file says it: the declaration of all its keys.
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpm/organ/scene/experiment_blocks.hpp"
#include "tpm/organ/scene/load_blocks.hpp"

namespace tpm::organ {

struct SceneKeys {
  std::optional<std::string> title, description;
  OrganKeys organ;
  BondKeys bonds;
  MaterialKeys material;
  std::optional<std::vector<AnchorKeys>> anchors;
  std::optional<std::vector<std::size_t>> sliders;
  std::optional<std::vector<LoadKeys>> loads;
  std::optional<std::vector<ContactKeys>> contacts;
  std::optional<ContactMotionKeys> protocol;
  std::optional<FormulationKeys> formulation;
  std::optional<OutputKeys> outputs;
  std::optional<double> tolerance;
};
[[nodiscard]] const Block<SceneKeys>& scene_block();
[[nodiscard]] const FileKind& scene_kind();

/// The tissue that a scene says. Throws Error(bad_input) with the key.
/// @param folder that a mesh path is relative to
[[nodiscard]] Tissue tissue_of(const SceneKeys& scene, const DocumentPlace& place,
                               const std::filesystem::path& folder);

}  // namespace tpm::organ
