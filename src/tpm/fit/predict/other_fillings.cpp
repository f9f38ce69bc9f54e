#include "tpm/fit/predict/other_fillings.hpp"

#include <fmt/format.h>

#include "tpm/organ/scene/blocks.hpp"
#include "tpm/work/give_up.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr int kMostSeeds = 20;

bool any_is(const Json& list, std::initializer_list<const char*> kinds) {
  for (const Json& entry : list) {
    for (const char* kind : kinds) {
      if (entry.value("kind", "") == kind) return true;
    }
  }
  return false;
}

/// Why another seed does not fill the body otherwise; empty: it does.
std::string no_other_filling(const Json& scene) {
  const std::string kind = scene.at("organ").at("kind");
  if (kind == "block") return "the lattice of a block ends at its faces";
  if (kind == "star") return "a star has its four spheres";
  if (kind == "listed") return "its spheres are listed one by one";
  const Json material = scene.value("material", Json::object());
  if (scene.contains("sliders") || any_is(scene.value("anchors", Json::array()), {"spheres"}) ||
      any_is(material.value("regions", Json::array()), {"spheres", "layer"})) {
    return "the scene names spheres by their numbers";
  }
  return {};
}

/// The organ of a scene, pressed at the outer sphere nearest to a place.
SceneOrgan pressed_near(Json scene, const Organ& own) {
  constexpr const char* kWhere = "another filling of the body";
  if (!scene.contains("contacts")) return organ_of_scene(scene, kWhere, {});
  Json& contact = scene["contacts"][0];
  if (!contact.contains("number") && !contact.contains("at")) {
    return organ_of_scene(scene, kWhere, {});
  }
  contact.erase("number");
  contact.erase("at");
  const SceneOrgan filled = organ_of_scene(scene, kWhere, {});
  const auto place = static_cast<Eigen::Index>(own.contact.value());
  contact["number"] =
      nearest_outer_sphere(filled.tissue->network.organ, own.position.col(place)) + 1;
  const Eigen::Vector3d direction = -own.normal.col(place);
  contact["direction"] = {direction.x(), direction.y(), direction.z()};
  return organ_of_scene(scene, kWhere, {});
}

}  // namespace

OtherFillings other_fillings(const OrganOfLaw& organ) {
  OtherFillings found;
  Json scene = organ.scene();
  if (const std::string why = no_other_filling(scene); !why.empty()) {
    found.words = fmt::format("without the effect of the places of the spheres: {}", why);
    return found;
  }
  const auto own = scene.at("organ").value("seed", std::uint64_t{1});
  std::vector<std::string> seeds;
  for (int i = 1; i <= kMostSeeds && std::ssize(seeds) < kOtherFillings; ++i) {
    scene["organ"]["seed"] = own + static_cast<std::uint64_t>(i);
    try {
      found.organs.emplace_back(
          new OrganOfLaw(organ.with(pressed_near(scene, organ.spheres_of_scene()))));
      seeds.push_back(std::to_string(own + static_cast<std::uint64_t>(i)));
    } catch (const Error&) {
      continue;  // this filling does not stand
    }
  }
  if (std::ssize(seeds) < kOtherFillings) {
    found.organs.clear();
    found.words = fmt::format(
        "without the effect of the places of the spheres: only {} of {} other "
        "fillings stand",
        seeds.size(), kMostSeeds);
    return found;
  }
  found.words = fmt::format("the scatter over {} other fillings of the body (seeds {}) included",
                            seeds.size(), fmt::join(seeds, ", "));
  return found;
}

}  // namespace tpm::fit
