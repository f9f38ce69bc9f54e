#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpmkit/bond_element.hpp"

namespace tpm::organ {

/// A sphere that may only move along a line; one that may move in a plane has two of them, one
/// after the other, along directions square to each other.
struct Slider {
  std::size_t sphere = 0;
  Eigen::Vector3d direction;  ///< unit vector
};

/// Code of the assumption of a scene that states neither E nor a spacing law: the paper's is kept.
inline constexpr std::string_view kSpacingLawKept = "spacing_law_paper";

/// Tissue of a scene: spheres, bonds, material, and constraints.
struct Tissue {
  std::string title;
  bool liver = false;  ///< x is to the patient's right, y up, z to the back
  bool star = false;   ///< the paper's element of four spheres
  Network network;
  MaterialField materials;
  /// The first material is stated by the constants E1, E2 and eta1 of the paper's element: fits
  /// address it by these names.
  bool by_constants = false;
  std::vector<std::size_t> anchors;       ///< fixed spheres, rising, from 0
  std::vector<std::string> anchor_words;  ///< one entry per anchor block, for people
  std::vector<Slider> sliders;
  std::vector<std::string>
      unused_blocks;  ///< blocks of the scene that say nothing about the tissue

  [[nodiscard]] BondSystem bonds() const { return {network, materials}; }
  [[nodiscard]] Constraints constraints() const;

  /// One material of one linear branch everywhere: the paper's element.
  [[nodiscard]] bool is_element() const;
  /// That element, for what takes no other material. Throws Error(bad_input) unless is_element().
  /// @param user in words, for the message: "the element"
  [[nodiscard]] BondElement element(std::string_view user = "this formulation") const;
};

/// Reads the blocks organ, bonds, material, anchors and sliders of a scene
/// (schemas/scene.schema.json, docs/network.md).
/// @param place for messages, usually the file
/// @param folder that a mesh path is relative to
/// Throws Error(bad_input) with the key.
[[nodiscard]] Tissue parse_tissue(const Json& scene, const DocumentPlace& place,
                                  const std::filesystem::path& folder);

/// The scene with the spheres that fill a mesh listed in the mesh's place, its name and SHA-256 in
/// the description: it needs no file beside it any more. Other scenes are returned as they are.
/// Throws as parse_tissue does.
[[nodiscard]] Json with_mesh_listed(Json scene, const DocumentPlace& place,
                                    const std::filesystem::path& folder);

/// read_json and parse_tissue.
[[nodiscard]] Tissue read_tissue(const std::filesystem::path& scene);

/// Throws Error(bad_input) unless the network stands: something is anchored, and it is sound.
void require_standing(const Tissue& tissue, std::string_view where);

/// Throws Error(bad_input) if the organ's own contact sphere is anchored. A scene whose contacts
/// are others does not ask.
void require_free_contact(const Tissue& tissue, std::string_view where);

/// Throws Error(bad_input) unless bonds hold every sphere (outer_support.hpp), no motion but those
/// of the whole body is free of energy (not looked for above kMostSpheresForModes spheres), and no
/// sphere is loose (local_support.hpp). What is written for others to compute with is asked this
/// much, also without anchors.
void require_sound(const Tissue& tissue, std::string_view where);

/// Above this a scene's modes are not counted: the factorisation would take too long.
inline constexpr std::size_t kMostSpheresForModes = 20'000;

/// Throws Error(bad_input) unless a load or an imposed depth on a sphere can move it along a
/// direction: it exists, is not anchored, and its guide, if any, is not square to the direction.
/// @param sphere from 0
void require_loadable(const Tissue& tissue, std::size_t sphere, const Eigen::Vector3d& direction,
                      std::string_view where);

}  // namespace tpm::organ
