#pragma once
// Parts of parse_tissue, one per block of a scene. All throw Error(bad_input) with the key; all are
// given blocks that the schema has accepted.
#include <optional>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::organ {

/// What the block `organ` leads to: the spheres, and the pairs to be joined if it names them.
struct OrganBlock {
  Organ organ;
  bool star = false;   ///< the four spheres of the element: bonds, anchors and guide are its own
  bool liver = false;  ///< has a far side that is fixed unless the scene says otherwise
};

/// Block `organ`.
[[nodiscard]] OrganBlock parse_organ(const Json& block, const DocumentPlace& place,
                                     const std::filesystem::path& folder);

/// The sphere of the outer layer that is nearest to a place.
[[nodiscard]] std::size_t nearest_outer_sphere(const Organ& organ, const Eigen::Vector3d& place);

/// The block of the same body filled with spheres whose spacing is the own one over `finer`, and
/// the number of spheres that it states; none where cells or layers cannot be so many. A shell
/// keeps its thickness by its number of layers.
/// @param organ what the block leads to
/// Throws Error(bad_input) for kinds whose spheres are given one by one.
[[nodiscard]] std::optional<std::pair<Json, std::size_t>> refilled_organ(
    const Json& block, const Organ& organ, double finer, const DocumentPlace& place);
/// The values of `finer` that make sense for a block, rising, 1 among them.
[[nodiscard]] std::vector<double> refilling_steps(const Json& block, const Organ& organ);

/// Block `bonds`.
[[nodiscard]] NetworkOptions parse_bonds(const Json& block, const DocumentPlace& place);
[[nodiscard]] LateralBond parse_lateral(const Json& block, const DocumentPlace& place);

/// What a block `material` leads to.
struct MaterialBlock {
  MaterialField materials;
  bool by_constants = false;  ///< the block gives those of the paper's element
};
[[nodiscard]] MaterialBlock parse_material(const Json& block, LateralBond lateral,
                                           const Organ& organ, const DocumentPlace& place);

/// The spheres that an entry of `anchors` holds, and that in words.
struct AnchorBlock {
  std::vector<std::size_t> spheres;
  std::string words;
};
[[nodiscard]] AnchorBlock parse_anchor(const Json& entry, const Organ& organ,
                                       const DocumentPlace& place);

/// A number of a sphere, from 1 in the file and from 0 in memory.
[[nodiscard]] std::size_t parse_sphere(const Json& number, const Organ& organ,
                                       const DocumentPlace& place);

/// Three lengths such as ["2 mm", "0 mm", "1 cm"], m.
[[nodiscard]] Eigen::Vector3d parse_point(const Json& list, const DocumentPlace& place);

}  // namespace tpm::organ
