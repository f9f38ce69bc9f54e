#pragma once
// The blocks of a scene that say what the tissue is: the declaration of their keys, and what they
// lead to. All throw Error(bad_input) with the key.
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/block.hpp"
#include "tpm/organ/body/lattice.hpp"
#include "tpm/organ/body/liver_surface.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::organ {

/// The number of a sphere in files, from 1.
[[nodiscard]] ValueType<std::size_t> sphere_type();
/// Three coordinates such as ["2 mm", "0 mm", "1 cm"], m.
using PointKeys = std::array<double, 3>;
[[nodiscard]] ValueType<PointKeys> point_type();
[[nodiscard]] inline Eigen::Vector3d vector_of(const std::array<double, 3>& coordinates) {
  return {coordinates[0], coordinates[1], coordinates[2]};
}

enum class OrganKind { liver, mesh, block, star, listed };
enum class Filling { shell, solid };

/// A sphere that a scene lists.
struct ListedSphere {
  std::array<double, 3> at{};  ///< in the organ's unit
  int layer = 1;
  std::optional<std::array<double, 3>> normal;
};

/// The measures of a liver that a scene states.
struct ShapeKeys {
  LiverShape shape;
  bool has_width = false;
};

/// Block `organ` as a file says it.
struct OrganKeys {
  OrganKind kind = OrganKind::liver;
  std::optional<std::size_t> count;
  std::optional<int> layers;
  std::optional<double> spacing_m;
  std::optional<std::uint64_t> seed;
  Filling filling = Filling::shell;
  std::optional<Lattice> lattice;
  std::optional<ShapeKeys> shape;
  std::string mesh, unit;
  std::optional<PointKeys> landing;
  std::array<int, 3> cells{};
  std::optional<double> length_m;
  std::optional<std::size_t> contact;
  std::vector<ListedSphere> spheres;
};
[[nodiscard]] const Kinds<OrganKeys, OrganKind>& organ_kinds();

/// Result of the block `organ`: the spheres, and the pairs to be joined if it names them.
struct OrganBlock {
  Organ organ;
  bool star = false;   ///< the four spheres of the element: bonds, anchors and guide are its own
  bool liver = false;  ///< has a far side that is fixed unless the scene says otherwise
};

[[nodiscard]] OrganBlock organ_of(const OrganKeys& block, const DocumentPlace& place,
                                  const std::filesystem::path& folder);

/// The sphere of the outer layer that is nearest to a place.
[[nodiscard]] std::size_t nearest_outer_sphere(const Organ& organ, const Eigen::Vector3d& place);

/// The block of the same body filled with spheres whose spacing is the own one over `finer`, and
/// the number of spheres that it states; none where cells or layers cannot be so many. A shell
/// keeps its thickness by its number of layers.
/// @param written the block as it stands in the file
/// @param organ what the block leads to
/// Throws Error(bad_input) for kinds whose spheres are given one by one.
[[nodiscard]] std::optional<std::pair<Json, std::size_t>> refilled_organ(
    const Json& written, const OrganKeys& block, const Organ& organ, double finer,
    const DocumentPlace& place);
/// The values of `finer` that make sense for a block, rising, 1 among them.
[[nodiscard]] std::vector<double> refilling_steps(const OrganKeys& block, const Organ& organ);

/// Block `bonds` as a file says it.
struct BondKeys {
  NetworkOptions options;
  LateralBond lateral = LateralBond::elastic;
  std::optional<SpacingLaw> spacing_law;  ///< as the file states it
};
[[nodiscard]] const Block<BondKeys>& bonds_block();

/// A material of bonds as a file says it: the paper's element, or Einf with what relaxes.
struct PlainMaterialKeys {
  struct Branch {
    double modulus_Pa = 0.0, relaxation_time_s = 0.0;
  };
  struct Fractional {
    double modulus_Pa = 0.0, order = 1.0, relaxation_time_s = 0.0, shortest_s = 0.0,
           longest_s = 0.0, error = 1e-3;
  };
  std::optional<double> E1_Pa, E2_Pa, Eprime_Pa, eta1_Pa_s, A0_m2, l0_m, Einf_Pa;
  std::optional<std::vector<Branch>> branches;
  std::optional<Fractional> fractional;
  ElongationFunction potential, kernel;
};

enum class RegionKind { layer, ball, box, spheres, function };

/// A region of another stiffness or material.
struct RegionKeys {
  RegionKind kind = RegionKind::layer;
  int layer = 1;
  std::optional<PointKeys> centre, from, to;
  std::optional<double> below_contact_m;
  double radius_m = 0.0;
  std::vector<std::size_t> spheres;
  std::optional<double> factor;
  std::string formula;  ///< of the kind function
  std::optional<PlainMaterialKeys> material;
};

/// Block `material`.
struct MaterialKeys {
  PlainMaterialKeys plain;
  std::optional<double> E_Pa, nu;  ///< of the tissue
  std::vector<RegionKeys> regions;
  BlendRule between = BlendRule::mean;
};
[[nodiscard]] const Block<MaterialKeys>& material_block();

/// Result of a block `material`.
struct MaterialBlock {
  MaterialField materials;
  bool by_constants = false;  ///< the block gives those of the paper's element
};
[[nodiscard]] MaterialBlock material_of(const MaterialKeys& block, LateralBond lateral,
                                        const Organ& organ, const DocumentPlace& place);
/// Of a block in which numbers may stand for quantities, SI.
[[nodiscard]] MaterialBlock parse_material(const Json& block, LateralBond lateral,
                                           const Organ& organ, const DocumentPlace& place);

enum class AnchorKind { far_side, inner_layer, spheres, half_space };

/// An entry of `anchors`.
struct AnchorKeys {
  AnchorKind kind = AnchorKind::far_side;
  double fraction = 0.3;  ///< of the organ's depth along the probe's axis
  std::vector<std::size_t> spheres;
  PointKeys point{};
  std::array<double, 3> normal{};
  bool slides = false;  ///< only the motion along the normal is held
};
[[nodiscard]] const Kinds<AnchorKeys, AnchorKind>& anchor_kinds();

/// The spheres that an entry of `anchors` holds, and that in words.
struct AnchorBlock {
  std::vector<std::size_t> spheres;
  std::string words;
  std::optional<Eigen::Vector3d> along = std::nullopt;  ///< all that is held; none: everything
};
[[nodiscard]] AnchorBlock anchor_of(const AnchorKeys& entry, const Organ& organ,
                                    const DocumentPlace& place);

/// The index of a sphere with a number. Throws unless the organ has it.
[[nodiscard]] std::size_t sphere_of(std::size_t number, const Organ& organ,
                                    const DocumentPlace& place);

}  // namespace tpm::organ
