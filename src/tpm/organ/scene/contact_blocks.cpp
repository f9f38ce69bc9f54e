// Declared in tpm/organ/scene/experiment_blocks.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpm/organ/scene/experiment_blocks.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr auto kContactWords = std::to_array<Word<ContactKind>>({{ContactKind::sphere, "sphere"},
                                                                 {ContactKind::patch, "patch"},
                                                                 {ContactKind::ball, "ball"},
                                                                 {ContactKind::punch, "punch"}});

/// The sphere nearest to a point that lies on or in the organ.
std::size_t sphere_at(const Eigen::Vector3d& at, const Organ& organ, const DocumentPlace& place) {
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

std::size_t driven_sphere(const ContactKeys& contact, const Organ& organ,
                          const DocumentPlace& place) {
  if (contact.number) return sphere_of(*contact.number, organ, place.key("number"));
  if (contact.at) return sphere_at(vector_of(*contact.at), organ, place.key("at"));
  if (organ.contact) return *organ.contact;
  throw bad_input(place.where, "names no sphere, and the organ has no contact",
                  "a key 'number', such as 71");
}

Eigen::Vector3d direction_of(const ContactKeys& contact, const Organ& organ, std::size_t sphere) {
  if (contact.direction) return vector_of(*contact.direction).stableNormalized();
  return -organ.normal.col(static_cast<Eigen::Index>(sphere));
}

/// A size wider than the organ acts like one as wide: it is a slip of the unit.
double radius_of(double radius, const Organ& organ, const DocumentPlace& place) {
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

/// Tools may press where others do.
void require_driven_once(const std::vector<SceneContact>& contacts, const Organ& organ,
                         const DocumentPlace& place) {
  std::map<std::size_t, std::size_t> driven_by;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (contacts[i].is_tool()) continue;
    for (const std::size_t sphere : spheres_of(contacts[i], organ)) {
      const auto [first, is_new] = driven_by.emplace(sphere, i);
      if (is_new) continue;
      throw bad_input(place.key(std::to_string(i)).where,
                      fmt::format("drives sphere {}, which contact /contacts/{} drives too",
                                  sphere + 1, first->second),
                      "each sphere in one contact");
    }
  }
}

}  // namespace

const Kinds<ContactKeys, ContactKind>& contact_kinds() {
  using K = ContactKeys;
  const Range driven{.least = 0.0, .most = 1e3, .above = true};
  const auto common = [](const Range& share) {
    return std::vector<Key<K>>{
        key("number", &K::number, sphere_type(),
            "the sphere driven or aimed at; default: the organ's contact sphere"),
        key("at", &K::at, point_type(), "instead: the sphere nearest to this point"),
        key("direction", &K::direction, direction(),
            "into the tissue; default: against the sphere's outward normal"),
        key("share", &K::share, number(share),
            "of the depth, or of the load against those of the others"),
        key("protocol", &K::protocol, contact_motion_kinds().type(),
            "its own, from when the others begin; default: the scene's")};
  };
  const auto radius = required(key("radius", &K::radius_m, quantity(Dimension::length, kAboveZero),
                                   "radius of what touches"));
  std::vector<Key<K>> patch = common(driven);
  patch.push_back(radius);
  std::vector<Key<K>> tool = common({.least = 0.0, .most = 1e3});
  tool.push_back(radius);
  tool.push_back(
      key("stiffness", &K::stiffness_N_per_m, quantity(Dimension::stiffness, kAboveZero),
          "of each contact; default: 10000 times the stiffest bond, inertial 1000000 times"));
  tool.push_back(key("mass_kg", &K::mass_kg, number(kAboveZero),
                     "of the tool, where the formulation has mass"));
  const auto word = [](ContactKind kind) { return std::string(to_string(kind)); };
  static const Kinds<K, ContactKind> kinds(
      {.name = "contact", .sentence = "what meets the tissue, driven by the protocol"}, &K::kind,
      {{ContactKind::sphere, word(ContactKind::sphere), "one sphere is driven, as in the paper",
        common(driven)},
       {ContactKind::patch, word(ContactKind::patch),
        "the spheres of its layer within the radius are driven together", patch},
       {ContactKind::ball, word(ContactKind::ball),
        "a rigid ball without friction pushes spheres and does not hold them", tool},
       {ContactKind::punch, word(ContactKind::punch),
        "a rigid flat punch without friction pushes spheres and does not hold them", tool}},
      {{"either 'number' or 'at'",
        [](const K& contact) -> std::optional<Fault> {
          if (!contact.number || !contact.at) return std::nullopt;
          return Fault{"", "says where twice"};
        }},
       {"a share of the scene's protocol or a protocol of its own",
        [](const K& contact) -> std::optional<Fault> {
          if (!contact.protocol || contact.share == 1.0) return std::nullopt;
          return Fault{"share", "is of no protocol"};
        }}});
  return kinds;
}

std::string_view to_string(ContactKind kind) {
  return entry_of(kContactWords, kind).text;
}

namespace {

SceneContact contact_of(const ContactKeys& block, const Tissue& tissue,
                        const DocumentPlace& place) {
  const Organ& organ = tissue.network.organ;
  SceneContact contact;
  contact.kind = block.kind;
  contact.probe.sphere = driven_sphere(block, organ, place);
  contact.probe.direction = direction_of(block, organ, contact.probe.sphere);
  contact.probe.share = block.share;
  if (block.kind != ContactKind::sphere) contact.radius_m = radius_of(block.radius_m, organ, place);
  contact.stiffness_N_per_m = block.stiffness_N_per_m;
  contact.mass_kg = block.mass_kg;
  require_loadable(tissue, contact.probe.sphere, contact.probe.direction, place.where);
  if (contact.kind == ContactKind::patch) require_patch_free(contact, tissue, place);
  return contact;
}

}  // namespace

SceneContact parse_contact(const Json& block, const Tissue& tissue, const DocumentPlace& place) {
  const ContactKeys keys = contact_kinds().read(block, place, Numbers::also_si);
  if (keys.protocol) {
    throw bad_input(place.key("protocol").where, "of a contact that the session moves",
                    "none: a scene of tpm simulate has contacts with protocols");
  }
  return contact_of(keys, tissue, place);
}

std::vector<SceneContact> contacts_of(const std::vector<ContactKeys>& contacts,
                                      const Tissue& tissue, const DocumentPlace& place,
                                      const std::filesystem::path& folder) {
  std::vector<SceneContact> all;
  for (const ContactKeys& block : contacts) {
    const DocumentPlace entry = place.key(std::to_string(all.size()));
    all.push_back(contact_of(block, tissue, entry));
    if (block.protocol) {
      all.back().protocol = protocol_of(*block.protocol, entry.key("protocol"), folder);
    }
  }
  require_driven_once(all, tissue.network.organ, place);
  if (all.front().probe.share > 0.0) return all;
  throw bad_input(place.key("0").key("share").where, "the first contact stands still",
                  "one that is driven first");
}

Protocol protocol_of_scene(const std::optional<Protocol>& common,
                           const std::vector<SceneContact>& contacts, const DocumentPlace& place) {
  const Protocol& first = contacts.front().protocol ? *contacts.front().protocol : *common;
  double end_s = first.knots().back().time_s;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const SceneContact& contact = contacts[i];
    const DocumentPlace entry = place.key(std::to_string(i));
    if (!contact.protocol) {
      if (contact.probe.share == 0.0 || !contacts.front().protocol) continue;
      throw bad_input(entry.key("protocol").where, "is missing",
                      "a protocol of its own, as the first contact has");
    }
    if (contact.protocol->start_s() != first.start_s()) {
      throw bad_input(
          entry.key("protocol").where,
          fmt::format("begins at {} s", shortest(contact.protocol->start_s())),
          fmt::format("{} s, where that of the first contact begins", shortest(first.start_s())));
    }
    end_s = std::max(end_s, contact.protocol->knots().back().time_s);
  }
  const auto is_own = [](const SceneContact& c) { return c.protocol.has_value(); };
  if (first.peak() == 0.0 && std::any_of(contacts.begin() + 1, contacts.end(), is_own)) {
    throw bad_input(place.key("0").where, "the first contact stands still",
                    "one that is driven first");
  }
  std::vector<Knot> knots(first.knots().begin(), first.knots().end());
  if (end_s > knots.back().time_s) knots.push_back({end_s, knots.back().value});
  return {first.drive(), std::move(knots), first.name()};
}

SceneContact usual_contact(const Tissue& tissue, const DocumentPlace& place) {
  return contact_of({}, tissue, place);
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
  for (const SceneContact& contact : contacts) {
    const Protocol& own = contact.protocol ? *contact.protocol : protocol;
    const bool by_depth = own.drive() == Drive::displacement;
    const double room = tissue_behind_m(tissue.network.organ, contact.probe);
    const double depth = contact.probe.share * own.peak();
    if (by_depth && !(depth < room)) {
      throw bad_input(place.where, fmt::format("a depth of {} mm", significant(1e3 * depth, 4)),
                      fmt::format("less than the {} mm of tissue behind sphere {}",
                                  significant(1e3 * room, 4), contact.probe.sphere + 1));
    }
    for (const Knot& knot : own.knots()) {
      if (by_depth || !contact.is_tool() || knot.value >= 0.0) continue;
      throw bad_input(
          place.where,
          fmt::format("a load of {} N at {} s", shortest(knot.value), shortest(knot.time_s)),
          "0 N or more: a tool pushes and does not hold");
    }
  }
}

}  // namespace tpm::organ
