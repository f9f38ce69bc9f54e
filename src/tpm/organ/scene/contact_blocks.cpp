// Declared in tpm/organ/scene/experiment_blocks.hpp.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpm/organ/scene/experiment_blocks.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

const std::array<KindKeys<ContactKind>, 4>& contact_kinds() {
  static const std::array<KindKeys<ContactKind>, 4> kinds{{
      {ContactKind::sphere, "sphere", {}, {"number", "at", "direction", "share"}},
      {ContactKind::patch, "patch", {"radius"}, {"number", "at", "direction", "share"}},
      {ContactKind::ball,
       "ball",
       {"radius"},
       {"number", "at", "direction", "share", "stiffness", "mass_kg"}},
      {ContactKind::punch,
       "punch",
       {"radius"},
       {"number", "at", "direction", "share", "stiffness", "mass_kg"}},
  }};
  return kinds;
}

/// The sphere nearest to a point that lies on or in the organ.
std::size_t sphere_at(const Json& point, const Organ& organ, const DocumentPlace& place) {
  const Eigen::Vector3d at = parse_point(point, place);
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const double away = (organ.position.col(static_cast<Eigen::Index>(i)) - at).norm();
    if (!(away < least)) continue;
    nearest = i;
    least = away;
  }
  if (least <= organ.spacing) return nearest;
  throw bad_input(place.where,
                  fmt::format("lies outside the organ, {} mm from its nearest sphere ({})",
                              significant(1e3 * least, 4), nearest + 1),
                  fmt::format("a point within a spacing, {} mm, of a sphere",
                              significant(1e3 * organ.spacing, 4)));
}

std::size_t driven_sphere(const Json& contact, const Organ& organ, const DocumentPlace& place) {
  if (contact.contains("number") && contact.contains("at")) {
    throw bad_input(place.where, "says where twice", "either 'number' or 'at'");
  }
  if (contact.contains("number")) {
    return parse_sphere(contact.at("number"), organ, place.key("number"));
  }
  if (contact.contains("at")) return sphere_at(contact.at("at"), organ, place.key("at"));
  if (organ.contact) return *organ.contact;
  throw bad_input(place.where, "names no sphere, and the organ has no contact",
                  "a key 'number', such as 71");
}

Eigen::Vector3d direction_of(const Json& contact, const Organ& organ, std::size_t sphere,
                             const DocumentPlace& place) {
  if (!contact.contains("direction")) {
    return -organ.normal.col(static_cast<Eigen::Index>(sphere));
  }
  const auto d = contact.at("direction").get<std::array<double, 3>>();
  Eigen::Vector3d direction = Eigen::Vector3d(d[0], d[1], d[2]).stableNormalized();
  if (direction.norm() < 0.5) {
    throw bad_input(place.key("direction").where, "has no length", "a direction");
  }
  return direction;
}

double share_of(const Json& contact, bool tool, const DocumentPlace& place) {
  const double share = contact.value("share", 1.0);
  if (share > 0.0 && share <= 1e3) return share;
  if (tool && share == 0.0) return share;
  throw bad_input(place.key("share").where, shortest(share),
                  tool ? "0 (a tool that stands still) to 1000" : "above 0, at most 1000");
}

/// What is wider than the organ acts like what is as wide: such a size is a slip of the unit.
double radius_of(const Json& contact, const Organ& organ, const DocumentPlace& place) {
  const double radius = positive_at(contact, "radius", Dimension::length, place);
  const double extent =
      (organ.position.rowwise().maxCoeff() - organ.position.rowwise().minCoeff()).norm() +
      2.0 * organ.radius;
  if (radius <= extent) return radius;
  throw bad_input(
      place.key("radius").where, fmt::format("{} mm", significant(1e3 * radius, 4)),
      fmt::format("at most the extent of the organ, {} mm", significant(1e3 * extent, 4)));
}

void require_patch_free(const SceneContact& patch, const Tissue& tissue,
                        const DocumentPlace& place) {
  const Constraints constraints = tissue.constraints();
  const Eigen::Vector3d& direction = patch.probe.direction;
  for (const std::size_t sphere : spheres_of(patch, tissue.network.organ)) {
    if ((constraints.projector(sphere) * direction - direction).norm() < 1e-9) continue;
    throw bad_input(
        place.key("radius").where,
        fmt::format("the patch has sphere {}, which cannot move along the push", sphere + 1),
        "a smaller radius, or a place away from anchors and sliders");
  }
}

}  // namespace

std::string_view word_of(ContactKind kind) {
  return entry_of(contact_kinds(), kind).text;
}

SceneContact parse_contact(const Json& block, const Tissue& tissue, const DocumentPlace& place) {
  const Organ& organ = tissue.network.organ;
  const auto name = block.at("kind").get<std::string>();
  const KindKeys<ContactKind>& kind = *find_entry(contact_kinds(), name);  // the schema knows it
  require_keys_of(block, kind.text, kind.needed, kind.allowed, place);
  SceneContact contact;
  contact.kind = kind.meaning;
  contact.probe.sphere = driven_sphere(block, organ, place);
  contact.probe.direction = direction_of(block, organ, contact.probe.sphere, place);
  contact.probe.share = share_of(block, contact.is_tool(), place);
  if (block.contains("radius")) {
    contact.radius_m = radius_of(block, organ, place);
  }
  if (block.contains("stiffness")) {
    contact.stiffness_N_per_m = positive_at(block, "stiffness", Dimension::stiffness, place);
  }
  if (block.contains("mass_kg")) {
    contact.mass_kg = block.at("mass_kg").get<double>();
    if (!(*contact.mass_kg > 0.0)) {
      throw bad_input(place.key("mass_kg").where, shortest(*contact.mass_kg), "a mass above 0");
    }
  }
  require_loadable(tissue, contact.probe.sphere, contact.probe.direction, place.where);
  if (contact.kind == ContactKind::patch) require_patch_free(contact, tissue, place);
  return contact;
}

std::vector<SceneContact> parse_contacts(const Json& contacts, const Tissue& tissue,
                                         const DocumentPlace& place) {
  std::vector<SceneContact> all;
  for (const Json& block : contacts) {
    all.push_back(parse_contact(block, tissue, place.key(std::to_string(all.size()))));
  }
  if (all.front().probe.share > 0.0) return all;
  throw bad_input(place.key("0").key("share").where, "the first contact stands still",
                  "one that is driven first");
}

SceneContact usual_contact(const Tissue& tissue, const DocumentPlace& place) {
  const Json block{{"kind", word_of(ContactKind::sphere)}};
  return parse_contact(block, tissue, place);
}

std::vector<std::size_t> spheres_of(const SceneContact& contact, const Organ& organ) {
  const std::size_t middle = contact.probe.sphere;
  if (contact.kind == ContactKind::sphere) return {middle};
  std::vector<std::size_t> spheres;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const double away = (organ.position.col(static_cast<Eigen::Index>(i)) -
                         organ.position.col(static_cast<Eigen::Index>(middle)))
                            .norm();
    if (organ.layer[i] == organ.layer[middle] && away <= contact.radius_m) spheres.push_back(i);
  }
  return spheres;
}

double tissue_behind_m(const Organ& organ, const Probe& probe) {
  const Eigen::VectorXd along = organ.position.transpose() * probe.direction;
  const double room = along.maxCoeff() - along[static_cast<Eigen::Index>(probe.sphere)];
  return room > 0.0 ? room : std::numeric_limits<double>::infinity();
}

void require_possible(const Protocol& protocol, const std::vector<SceneContact>& contacts,
                      const Tissue& tissue, const DocumentPlace& place) {
  const bool by_depth = protocol.drive() == Drive::displacement;
  for (const SceneContact& contact : contacts) {
    const double room = tissue_behind_m(tissue.network.organ, contact.probe);
    const double depth = contact.probe.share * protocol.peak();
    if (by_depth && !(depth < room)) {
      throw bad_input(place.where, fmt::format("a depth of {} mm", significant(1e3 * depth, 4)),
                      fmt::format("less than the {} mm of tissue behind sphere {}",
                                  significant(1e3 * room, 4), contact.probe.sphere + 1));
    }
    for (const Knot& knot : protocol.knots()) {
      if (by_depth || !contact.is_tool() || knot.value >= 0.0) continue;
      throw bad_input(
          place.where,
          fmt::format("a load of {} N at {} s", shortest(knot.value), shortest(knot.time_s)),
          "0 N or more: a tool pushes and does not hold");
    }
  }
}

}  // namespace tpm::organ
