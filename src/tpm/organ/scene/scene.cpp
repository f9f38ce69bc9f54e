#include "tpm/organ/scene/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/balance/effective_moduli.hpp"
#include "tpm/organ/bonds/local_support.hpp"
#include "tpm/organ/bonds/material_refusal.hpp"
#include "tpm/organ/bonds/outer_support.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

Network joined(OrganBlock block, const NetworkOptions& options, const std::string& where) {
  if (!block.star) return build_network(std::move(block.organ), options, where);
  // B with A, C and its partner D: the element has no diagonals, however near the spheres are.
  constexpr std::array<NeighbourPair, 3> kElement{{{0, 1}, {1, 2}, {1, 3}}};
  return join(std::move(block.organ), kElement, options, where);
}

/// Anchors of a scene that states none.
std::vector<AnchorKeys> usual_anchors(bool star, bool liver) {
  if (star) return {{.kind = AnchorKind::spheres, .spheres = {1, 3, 4}}};
  if (liver) return {{.kind = AnchorKind::far_side, .spheres = {}}};
  return {};
}

bool is_anchored(const Tissue& tissue, std::size_t sphere) {
  return std::binary_search(tissue.anchors.begin(), tissue.anchors.end(), sphere);
}

void add_anchors(const std::vector<AnchorKeys>& entries, Tissue& tissue,
                 const DocumentPlace& place) {
  std::size_t index = 0;
  // Spheres that slide in a plane, listed twice: along two directions square to each other.
  for (const AnchorKeys& entry : entries) {
    AnchorBlock block = anchor_of(entry, tissue.network.organ, place.key(std::to_string(index++)));
    tissue.anchor_words.push_back(std::move(block.words));
    if (block.along) {
      const Eigen::Vector3d first = block.along->unitOrthogonal();
      for (const std::size_t sphere : block.spheres) {
        tissue.sliders.push_back({sphere, first});
        tissue.sliders.push_back({sphere, block.along->cross(first)});
      }
      continue;
    }
    tissue.anchors.insert(tissue.anchors.end(), block.spheres.begin(), block.spheres.end());
  }
  std::sort(tissue.anchors.begin(), tissue.anchors.end());
  std::erase_if(tissue.sliders, [&](const Slider& s) { return is_anchored(tissue, s.sphere); });
  std::set<std::size_t> sliding;
  for (std::size_t i = 0; i < tissue.sliders.size(); i += 2) {
    if (sliding.insert(tissue.sliders[i].sphere).second) continue;
    throw bad_input(place.where,
                    fmt::format("sphere {} slides on two planes", tissue.sliders[i].sphere + 1),
                    "one sliding half-space for each sphere");
  }
  tissue.anchors.erase(std::unique(tissue.anchors.begin(), tissue.anchors.end()),
                       tissue.anchors.end());
}

void add_sliders(const std::vector<std::size_t>& numbers, Tissue& tissue,
                 const DocumentPlace& place) {
  const Organ& organ = tissue.network.organ;
  std::size_t index = 0;
  for (const std::size_t number : numbers) {
    const DocumentPlace entry = place.key(std::to_string(index++));
    const std::size_t sphere = sphere_of(number, organ, entry);
    const bool slides = std::any_of(tissue.sliders.begin(), tissue.sliders.end(),
                                    [&](const Slider& other) { return other.sphere == sphere; });
    if (is_anchored(tissue, sphere) || slides) {
      throw bad_input(entry.where, fmt::format("sphere {} is anchored", sphere + 1),
                      "a sphere that may move");
    }
    tissue.sliders.push_back({sphere, organ.normal.col(static_cast<Eigen::Index>(sphere))});
  }
}

/// @param whole motions that may be free, as of whole_motions
void require_sound(const Tissue& tissue, std::string_view where, const Eigen::MatrixXd& whole) {
  const Organ& organ = tissue.network.organ;
  const BondSystem bonds = tissue.bonds();
  const Constraints constraints = tissue.constraints();
  if (!tissue.star) {  // A and C of a star have nothing below them, and are fixed
    require_outer_support(tissue.network, constraints, where);
    require_hold(tissue.network, constraints, where);
  }
  if (organ.size() <= kMostSpheresForModes) {
    require_rigid(bonds, organ.position, constraints, where, whole);
  }
  require_supported(bonds, organ, constraints, where);
}

}  // namespace

bool Tissue::is_element() const {
  return materials.materials.size() == 1 && materials.factor.size() == 0 &&
         BondElement{materials.materials.front()}.has_one_branch();
}

BondElement Tissue::element(std::string_view user) const {
  if (is_element()) return {materials.materials.front(), network.organ.spacing};
  const bool regions = materials.materials.size() > 1 || materials.factor.size() > 0;
  std::vector<MaterialNeed> needs = needs_of(bonds());
  for (const MaterialNeed need : needs_of(materials)) needs.push_back(need);
  throw bad_input(
      "material",
      fmt::format("{} takes the paper's element alone, and this material has {}", user,
                  regions ? "regions" : "laws of its own"),
      fmt::format("E1, E2, Eprime and eta1, or a formulation that takes it: {}",
                  formulations_that([&](const Formulation& formulation) {
                    return formulation.can().network &&
                           std::all_of(needs.begin(), needs.end(),
                                       [&](MaterialNeed need) { return formulation.can().*need; });
                  })));
}

Constraints Tissue::constraints() const {
  Constraints constraints(network.organ.size());
  for (std::size_t i = 0; i < sliders.size(); ++i) {
    const bool in_plane = i + 1 < sliders.size() && sliders[i + 1].sphere == sliders[i].sphere;
    if (in_plane) {
      constraints.impose(sliders[i].sphere, sliders[i].direction.cross(sliders[i + 1].direction));
      ++i;
    } else {
      constraints.slide(sliders[i].sphere, sliders[i].direction);
    }
  }
  for (const std::size_t sphere : anchors) constraints.fix(sphere);
  return constraints;
}

namespace {

NetworkOptions options_of(const SceneKeys& scene, const DocumentPlace& place) {
  NetworkOptions options = scene.bonds.options;
  const std::optional<SpacingLaw>& stated = scene.bonds.spacing_law;
  if (!scene.material.E_Pa) {
    options.spacing_law = stated.value_or(options.spacing_law);
    return options;
  }
  if (stated == SpacingLaw::paper) {
    throw bad_input(place.key("bonds").key("spacing_law").where,
                    "paper, under which a block has another modulus at each spacing",
                    "continuum, or no law, beside a material with E");
  }
  options.spacing_law = SpacingLaw::continuum;
  return options;
}

/// Multiplies the moduli of the first material so that the inside of the body has a Young's
/// modulus at equilibrium.
void scale_to_tissue(double E_Pa, std::optional<double> nu, Tissue& tissue,
                     const DocumentPlace& place) {
  BondMaterial& material = tissue.materials.materials.front();
  const std::optional<EffectiveModuli> own =
      effective_moduli(tissue.network, BondSystem(tissue.network, material), 1.0);
  if (!own || !(own->mean_young_Pa() > 0.0)) {
    throw bad_input(place.key("E").where, "of what has no inside to measure it on",
                    "a solid filling of a lattice, three or more spheres deep, of a material that "
                    "does not relax to nothing");
  }
  constexpr double kSameNu = 0.02;
  if (nu && std::abs(*nu - own->poisson) > kSameNu) {
    throw bad_input(
        place.key("nu").where,
        fmt::format("{}: central forces give this network {}; under a patch a tissue of 0.49 takes "
                    "28 % more force than one of 1/4 (measured)",
                    shortest(*nu), significant(own->poisson, 3)),
        "the network's own ratio, or none, with E raised for the error to be made in force");
  }
  const double factor = E_Pa / own->mean_young_Pa();
  material.equilibrium_Pa *= factor;
  material.lateral_Pa *= factor;
  for (BondMaterial::Branch& branch : material.branches) branch.modulus_Pa *= factor;
}

}  // namespace

Tissue tissue_of(const SceneKeys& scene, const DocumentPlace& place,
                 const std::filesystem::path& folder) {
  OrganBlock organ = organ_of(scene.organ, place.key("organ"), folder);
  const bool star = organ.star;
  Tissue tissue;
  tissue.liver = organ.liver;
  tissue.star = star;
  tissue.title = scene.title.value_or(organ.organ.name);
  tissue.network = joined(std::move(organ), options_of(scene, place), place.where);
  MaterialBlock material =
      material_of(scene.material, scene.bonds.lateral, tissue.network.organ, place.key("material"));
  tissue.materials = std::move(material.materials);
  tissue.by_constants = material.by_constants;
  if (scene.material.E_Pa) {
    scale_to_tissue(*scene.material.E_Pa, scene.material.nu, tissue, place.key("material"));
  } else if (!scene.bonds.spacing_law && !star) {
    tissue.network.organ.assumptions.push_back(
        {std::string(kSpacingLawKept),
         "spacing law paper, since the scene states neither E nor a law: the stiffness of a bond "
         "does not follow the spacing"});
  }
  add_anchors(scene.anchors.value_or(usual_anchors(star, tissue.liver)), tissue,
              place.key("anchors"));
  add_sliders(
      scene.sliders.value_or(star ? std::vector<std::size_t>{2} : std::vector<std::size_t>{}),
      tissue, place.key("sliders"));
  const auto unused = [&](bool there, const char* key) {
    if (there) tissue.unused_blocks.emplace_back(key);
  };
  unused(scene.loads.has_value(), "loads");
  unused(scene.contacts.has_value(), "contacts");
  unused(scene.protocol.has_value(), "protocol");
  unused(scene.formulation.has_value(), "formulation");
  unused(scene.outputs.has_value(), "outputs");
  unused(scene.tolerance.has_value(), "tolerance");
  return tissue;
}

Tissue parse_tissue(const Json& scene, const DocumentPlace& place,
                    const std::filesystem::path& folder) {
  const Json document = checked(scene, scene_kind(), place);
  return tissue_of(scene_block().made(document, place), place, folder);
}

Json with_mesh_listed(Json scene, const DocumentPlace& place, const std::filesystem::path& folder) {
  scene = checked(std::move(scene), scene_kind(), place);
  const SceneKeys keys = scene_block().made(scene, place);
  if (keys.organ.kind != OrganKind::mesh) return scene;
  const Organ organ = tissue_of(keys, place, folder).network.organ;
  Json spheres = Json::array();
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d at = organ.position.col(column), normal = organ.normal.col(column);
    spheres.push_back({{"at", {at.x(), at.y(), at.z()}},
                       {"layer", organ.layer[i] + 1},
                       {"normal", {normal.x(), normal.y(), normal.z()}}});
  }
  const std::string& mesh = keys.organ.mesh;
  const std::string said = keys.description.value_or("");
  scene["description"] =
      fmt::format("{}{}Its spheres fill the mesh {}, SHA-256 {}.", said, said.empty() ? "" : " ",
                  mesh, sha256_hex(read_file(folder / mesh)));
  scene["organ"] = {{"kind", "listed"},
                    {"unit", "m"},
                    {"spacing", shortest(organ.spacing) + " m"},
                    {"spheres", std::move(spheres)}};
  if (organ.contact) scene["organ"]["contact"] = *organ.contact + 1;
  return scene;
}

Tissue read_tissue(const std::filesystem::path& scene) {
  return parse_tissue(read_json(scene), scene.string(), scene.parent_path());
}

void require_standing(const Tissue& tissue, std::string_view where) {
  const Organ& organ = tissue.network.organ;
  const BondSystem bonds = tissue.bonds();
  const Constraints constraints = tissue.constraints();
  if (tissue.anchors.empty() && whole_motions(organ.position, constraints).cols() > 0) {
    const std::string modes = organ.size() > kMostSpheresForModes
                                  ? std::string("the 6 motions of a rigid body")
                                  : words(zero_energy_modes(bonds, organ.position, constraints));
    throw bad_input(where, fmt::format("not anchored: {}", modes),
                    "anchors that hold the organ, such as [{\"kind\": \"inner_layer\"}]");
  }
  require_sound(tissue, where, {});
}

void require_free_contact(const Tissue& tissue, std::string_view where) {
  const std::optional<std::size_t>& contact = tissue.network.organ.contact;
  if (contact && is_anchored(tissue, *contact)) {
    throw bad_input(where, fmt::format("the contact sphere {} is anchored", *contact + 1),
                    "anchors that leave it free");
  }
}

void require_sound(const Tissue& tissue, std::string_view where) {
  require_sound(tissue, where, whole_motions(tissue.network.organ.position, tissue.constraints()));
}

void require_loadable(const Tissue& tissue, std::size_t sphere, const Eigen::Vector3d& direction,
                      std::string_view where) {
  const std::size_t count = tissue.network.organ.size();
  if (sphere >= count) {
    throw bad_input(where, fmt::format("no sphere {}", sphere + 1), fmt::format("1 to {}", count));
  }
  if (is_anchored(tissue, sphere)) {
    throw bad_input(where, fmt::format("a load on sphere {}, which is anchored", sphere + 1),
                    "a sphere that may move");
  }
  if ((tissue.constraints().projector(sphere) * direction).norm() < 1e-6 * direction.norm()) {
    throw bad_input(where, fmt::format("a load on sphere {} square to its guide", sphere + 1),
                    "a direction in which the sphere may move");
  }
}

}  // namespace tpm::organ
