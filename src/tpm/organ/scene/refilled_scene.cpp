#include "tpm/organ/scene/refilled_scene.hpp"

#include <algorithm>
#include <utility>

#include "tpm/organ/scene/scene_keys.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

void refuse_numbered(const Json& list, const DocumentPlace& place,
                     std::initializer_list<const char*> kinds, const char* expected) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    for (const char* kind : kinds) {
      if (list[i].at("kind") != kind) continue;
      throw bad_input(place.key(std::to_string(i)).key("kind").where,
                      "names what another filling numbers otherwise", expected);
    }
  }
}

void require_limit(const Json& scene, const ExperimentScene& own, const DocumentPlace& place) {
  if (own.has_own_protocols() || own.dead_load_N.size() > 0) {
    throw bad_input(place.where, "has loads, or contacts with protocols of their own",
                    "one protocol alone");
  }
  if (own.tissue.network.options.spacing_law != SpacingLaw::continuum) {
    throw bad_input(place.key("bonds").key("spacing_law").where,
                    "under the law 'paper' tissue becomes stiffer with smaller spheres",
                    "\"continuum\", under which forces have a limit");
  }
  for (std::size_t i = 0; i < own.contacts.size(); ++i) {
    const DocumentPlace contact = place.key("contacts").key(std::to_string(i));
    if (own.contacts[i].kind == ContactKind::sphere) {
      throw bad_input(contact.key("kind").where, "one sphere is smaller where spheres are more",
                      "a patch, ball or punch, which keeps its size");
    }
    if (own.tissue.network.organ.layer[own.contacts[i].probe.sphere] != 0) {
      throw bad_input(contact.where, "aims at a sphere below the surface",
                      "one of the outer layer");
    }
  }
  refuse_numbered(scene.value("anchors", Json::array()), place.key("anchors"), {"spheres"},
                  "far_side, inner_layer or half_space");
  refuse_numbered(scene.value("material", Json::object()).value("regions", Json::array()),
                  place.key("material").key("regions"), {"spheres", "layer"},
                  "ball, box or function");
  if (!own.tissue.sliders.empty()) {
    throw bad_input(place.where, "spheres that slide along lines are named by their numbers",
                    "a scene without them");
  }
}

}  // namespace

RefilledScene::RefilledScene(Json document, std::string where, std::filesystem::path folder)
    : where_(std::move(where)),
      document_(checked(std::move(document), scene_kind(), where_)),
      folder_(std::move(folder)),
      own_(parse_checked_experiment(document_, where_, folder_)) {
  require_limit(document_, own_, DocumentPlace{where_});
  (void)refilled_organ(document_.at("organ"), own_.tissue.network.organ, 1.0,
                       DocumentPlace{where_}.key("organ"));
}

std::vector<RefilledScene::Filling> RefilledScene::fillings(std::size_t fewest,
                                                            std::size_t most) const {
  const Json& block = document_.at("organ");
  const Organ& organ = own_.tissue.network.organ;
  std::vector<Filling> found;
  for (const double finer : refilling_steps(block, organ)) {
    const auto refilled = refilled_organ(block, organ, finer, DocumentPlace{where_}.key("organ"));
    if (!refilled || refilled->second < fewest || refilled->second > most) continue;
    found.push_back({finer, refilled->second});
  }
  return found;
}

Json RefilledScene::document(const Filling& filling) const {
  if (filling.finer == 1.0) return document_;
  const DocumentPlace place = DocumentPlace{where_}.key("organ");
  const Organ& own = own_.tissue.network.organ;
  Json scene = document_;
  scene["organ"] = refilled_organ(document_.at("organ"), own, filling.finer, place).value().first;
  if (!scene.contains("contacts")) return scene;
  std::optional<Organ> organ;
  for (std::size_t i = 0; i < own_.contacts.size(); ++i) {
    Json& contact = scene["contacts"][i];
    const Probe& probe = own_.contacts[i].probe;
    const bool named = contact.contains("number") || contact.contains("at");
    if (!named || (own.contact && probe.sphere == *own.contact)) {
      contact.erase("number");
      contact.erase("at");
      continue;  // the organ's own contact
    }
    if (!organ) {
      organ = organ_of(organ_kinds().made(scene.at("organ"), place), place, folder_).organ;
    }
    contact.erase("at");
    contact["number"] =
        nearest_outer_sphere(*organ, own.position.col(static_cast<Eigen::Index>(probe.sphere))) + 1;
    contact["direction"] = {probe.direction.x(), probe.direction.y(), probe.direction.z()};
  }
  return scene;
}

ExperimentScene RefilledScene::scene(const Filling& filling) const {
  return filling.finer == 1.0 ? own_ : parse_experiment(document(filling), where_, folder_);
}

}  // namespace tpm::organ
