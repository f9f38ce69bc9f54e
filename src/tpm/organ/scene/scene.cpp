#include "tpm/organ/scene/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpm/organ/bonds/local_support.hpp"
#include "tpm/organ/bonds/material_refusal.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpm/organ/scene/inspection.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

/// Blocks of a scene that say what is done to the tissue, not what it is.
constexpr std::array<const char*, 5> kOtherBlocks{"contacts", "protocol", "formulation", "outputs",
                                                  "tolerance"};

Network joined(OrganBlock block, const NetworkOptions& options, const std::string& where) {
  if (!block.star) return build_network(std::move(block.organ), options, where);
  // B with A, C and its partner D: the element has no diagonals, however near the spheres are.
  constexpr std::array<NeighbourPair, 3> kElement{{{0, 1}, {1, 2}, {1, 3}}};
  return join(std::move(block.organ), kElement, options, where);
}

/// What is fixed if the scene does not say.
Json usual_anchors(bool star, bool liver) {
  if (star) return Json::array({{{"kind", "spheres"}, {"spheres", {1, 3, 4}}}});
  if (liver) return Json::array({{{"kind", "far_side"}}});
  return Json::array();
}

void read_anchors(const Json& entries, Tissue& tissue, const DocumentPlace& place) {
  std::size_t index = 0;
  for (const Json& entry : entries) {
    AnchorBlock block =
        parse_anchor(entry, tissue.network.organ, place.key(std::to_string(index++)));
    tissue.anchor_words.push_back(std::move(block.words));
    tissue.anchors.insert(tissue.anchors.end(), block.spheres.begin(), block.spheres.end());
  }
  std::sort(tissue.anchors.begin(), tissue.anchors.end());
  tissue.anchors.erase(std::unique(tissue.anchors.begin(), tissue.anchors.end()),
                       tissue.anchors.end());
}

bool is_anchored(const Tissue& tissue, std::size_t sphere) {
  return std::binary_search(tissue.anchors.begin(), tissue.anchors.end(), sphere);
}

void read_sliders(const Json& numbers, Tissue& tissue, const DocumentPlace& place) {
  const Organ& organ = tissue.network.organ;
  std::size_t index = 0;
  for (const Json& number : numbers) {
    const DocumentPlace entry = place.key(std::to_string(index++));
    const std::size_t sphere = parse_sphere(number, organ, entry);
    if (is_anchored(tissue, sphere)) {
      throw bad_input(entry.where, fmt::format("sphere {} is anchored", sphere + 1),
                      "a sphere that may move");
    }
    tissue.sliders.push_back({sphere, organ.normal.col(static_cast<Eigen::Index>(sphere))});
  }
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
  for (const Slider& slider : sliders) constraints.slide(slider.sphere, slider.direction);
  for (const std::size_t sphere : anchors) constraints.fix(sphere);
  return constraints;
}

Tissue parse_tissue(const Json& scene, std::string_view where,
                    const std::filesystem::path& folder) {
  return parse_checked_tissue(checked(scene, "scene", where), where, folder);
}

Tissue parse_checked_tissue(const Json& scene, std::string_view where,
                            const std::filesystem::path& folder) {
  const DocumentPlace place{std::string(where)};
  const auto block = [&](const char* key) { return scene.value(key, Json::object()); };
  OrganBlock organ = parse_organ(scene.at("organ"), place.key("organ"), folder);
  const Json anchors = scene.value("anchors", usual_anchors(organ.star, organ.liver));
  const Json sliders = scene.value("sliders", organ.star ? Json::array({2}) : Json::array());
  Tissue tissue;
  tissue.liver = organ.liver;
  tissue.star = organ.star;
  tissue.title = scene.value("title", organ.organ.name);
  const LateralBond lateral = parse_lateral(block("bonds"), place.key("bonds"));
  const Json material = block("material");
  tissue.network =
      joined(std::move(organ), parse_bonds(block("bonds"), place.key("bonds")), place.where);
  MaterialBlock read =
      parse_material(material, lateral, tissue.network.organ, place.key("material"));
  tissue.materials = std::move(read.materials);
  tissue.by_constants = read.by_constants;
  read_anchors(anchors, tissue, place.key("anchors"));
  read_sliders(sliders, tissue, place.key("sliders"));
  for (const char* key : kOtherBlocks) {
    if (scene.contains(key)) tissue.unused_blocks.emplace_back(key);
  }
  return tissue;
}

Json with_mesh_listed(Json scene, std::string_view where, const std::filesystem::path& folder) {
  scene = checked(std::move(scene), "scene", where);
  if (scene.at("organ").at("kind") != "mesh") return scene;
  const Organ organ = parse_tissue(scene, where, folder).network.organ;
  Json spheres = Json::array();
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d at = organ.position.col(column), normal = organ.normal.col(column);
    spheres.push_back({{"at", {at.x(), at.y(), at.z()}},
                       {"layer", organ.layer[i] + 1},
                       {"normal", {normal.x(), normal.y(), normal.z()}}});
  }
  const auto mesh = scene.at("organ").at("mesh").get<std::string>();
  const std::string said = scene.value("description", "");
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
  if (tissue.anchors.empty()) {
    const std::string modes = organ.size() > kMostSpheresForModes
                                  ? std::string("the 6 motions of a rigid body")
                                  : words(zero_energy_modes(bonds, organ.position, constraints));
    throw bad_input(where, fmt::format("not anchored: {}", modes),
                    "anchors that hold the organ, such as [{\"kind\": \"inner_layer\"}]");
  }
  if (organ.contact && is_anchored(tissue, *organ.contact)) {
    throw bad_input(where, fmt::format("the contact sphere {} is anchored", *organ.contact + 1),
                    "anchors that leave it free");
  }
  require_outer_held(tissue, where);
  if (organ.size() <= kMostSpheresForModes)
    require_rigid(bonds, organ.position, constraints, where);
  require_supported(bonds, organ, constraints, where);
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
