#include "tpm/organ/scene/refilled_scene.hpp"

#include <algorithm>
#include <utility>

#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

template <class Keys>
void refuse_numbered(const std::vector<Keys>& list, const DocumentPlace& place,
                     std::initializer_list<decltype(Keys::kind)> kinds, const char* expected) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (std::find(kinds.begin(), kinds.end(), list[i].kind) == kinds.end()) continue;
    throw bad_input(place.key(std::to_string(i)).key("kind").where,
                    "names what another filling numbers otherwise", expected);
  }
}

void require_limit(const SceneKeys& scene, const ExperimentScene& own, const DocumentPlace& place) {
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
  refuse_numbered(scene.anchors.value_or(std::vector<AnchorKeys>{}), place.key("anchors"),
                  {AnchorKind::spheres}, "far_side, inner_layer or half_space");
  refuse_numbered(scene.material.regions, place.key("material").key("regions"),
                  {RegionKind::spheres, RegionKind::layer}, "ball, box or function");
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
      keys_(scene_block().made(document_, DocumentPlace{where_})),
      own_(parse_checked_experiment(document_, where_, folder_)) {
  require_limit(keys_, own_, DocumentPlace{where_});
  (void)refilled(1.0);
}

std::optional<std::pair<Json, std::size_t>> RefilledScene::refilled(double finer) const {
  return refilled_organ(document_.at("organ"), keys_.organ, own_.tissue.network.organ, finer,
                        DocumentPlace{where_}.key("organ"));
}

std::vector<RefilledScene::Filling> RefilledScene::fillings(std::size_t fewest,
                                                            std::size_t most) const {
  std::vector<Filling> found;
  for (const double finer : refilling_steps(keys_.organ, own_.tissue.network.organ)) {
    const auto organ = refilled(finer);
    if (!organ || organ->second < fewest || organ->second > most) continue;
    found.push_back({finer, organ->second});
  }
  return found;
}

Json RefilledScene::document(const Filling& filling) const {
  if (filling.finer == 1.0) return document_;
  const Organ& own = own_.tissue.network.organ;
  Json scene = document_;
  scene["organ"] = refilled(filling.finer).value().first;
  if (!keys_.contacts) return scene;
  std::optional<Organ> organ;
  for (std::size_t i = 0; i < own_.contacts.size(); ++i) {
    Json& contact = scene["contacts"][i];
    const ContactKeys& said = keys_.contacts->at(i);
    const Probe& probe = own_.contacts[i].probe;
    contact.erase("at");
    if ((!said.number && !said.at) || (own.contact && probe.sphere == *own.contact)) {
      contact.erase("number");
      continue;  // the organ's own contact
    }
    if (!organ) {
      const DocumentPlace place = DocumentPlace{where_}.key("organ");
      organ = organ_of(organ_kinds().made(scene["organ"], place), place, folder_).organ;
    }
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
