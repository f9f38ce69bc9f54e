// Declared in tpm/organ/scene/blocks.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr std::array<Word<StiffnessRule>, 2> kRuleWords{
    {{StiffnessRule::normalised, "normalised"}, {StiffnessRule::per_bond, "per_bond"}}};
constexpr std::array<Word<SpacingLaw>, 2> kSpacingLawWords{
    {{SpacingLaw::paper, "paper"}, {SpacingLaw::continuum, "continuum"}}};
constexpr std::array<Word<LateralBond>, 3> kLateralWords{{{LateralBond::elastic, "elastic"},
                                                          {LateralBond::tension_only, "rope"},
                                                          {LateralBond::relaxing, "relaxing"}}};

/// The part of the organ's depth along the probe's axis that is fixed at its far side.
constexpr double kFarSide = 0.3;

template <class Words, class Value>
void read_word(const Json& block, const char* key, const Words& words, const DocumentPlace& place,
               Value& value) {
  if (!block.contains(key)) return;
  value = parse_word(words, key, block.at(key).get<std::string>(), place.key(key).where);
}

/// The spheres on the side of a plane that its normal points to.
std::vector<std::size_t> beyond(const Organ& organ, const Eigen::Vector3d& normal, double height) {
  std::vector<std::size_t> spheres;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (normal.dot(organ.position.col(static_cast<Eigen::Index>(i))) >= height) {
      spheres.push_back(i);
    }
  }
  return spheres;
}

AnchorBlock far_side(const Json& entry, const Organ& organ, const DocumentPlace& place) {
  if (!organ.contact) {
    throw bad_input(
        place.where, "far_side of an organ without a contact sphere",
        "a key landing in the organ, which says where the probe lands, or another kind of "
        "anchor");
  }
  const double fraction = entry.value("fraction", kFarSide);
  if (!(fraction > 0.0) || fraction > 1.0) {
    throw bad_input(place.key("fraction").where, shortest(fraction), "above 0, at most 1");
  }
  const Eigen::Vector3d axis = -organ.normal.col(static_cast<Eigen::Index>(*organ.contact));
  const Eigen::RowVectorXd depth = axis.transpose() * organ.position;
  const double height = depth.maxCoeff() - fraction * (depth.maxCoeff() - depth.minCoeff());
  return {beyond(organ, axis, height),
          fmt::format("the far {} % of the depth along the probe's axis",
                      shortest(rounded(100.0 * fraction, 6)))};
}

AnchorBlock inner_layer(const Organ& organ) {
  AnchorBlock block{{}, "the inner layer"};
  const int innermost = organ.layer_count() - 1;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == innermost) block.spheres.push_back(i);
  }
  return block;
}

AnchorBlock named_spheres(const Json& entry, const Organ& organ, const DocumentPlace& place) {
  AnchorBlock block;
  const DocumentPlace list = place.key("spheres");
  if (!entry.contains("spheres")) throw bad_input(list.where, "is missing", "a list of numbers");
  std::size_t index = 0;
  for (const Json& number : entry.at("spheres")) {
    block.spheres.push_back(parse_sphere(number, organ, list.key(std::to_string(index++))));
  }
  block.words = fmt::format("{} named sphere{}", index, index == 1 ? "" : "s");
  return block;
}

AnchorBlock half_space(const Json& entry, const Organ& organ, const DocumentPlace& place) {
  for (const char* key : {"point", "normal"}) {
    if (entry.contains(key)) continue;
    throw bad_input(place.key(key).where, "is missing", "a point of the plane and its normal");
  }
  const Eigen::Vector3d point = parse_point(entry.at("point"), place.key("point"));
  const auto n = entry.at("normal").get<std::array<double, 3>>();
  const Eigen::Vector3d normal = Eigen::Vector3d(n[0], n[1], n[2]).stableNormalized();
  if (normal.norm() < 0.5) {
    throw bad_input(place.key("normal").where, "has no length", "a direction");
  }
  return {beyond(organ, normal, normal.dot(point)), "a half-space"};
}

void require_keys(const Json& entry, const std::vector<std::string_view>& keys,
                  const DocumentPlace& place) {
  for (const auto& [key, value] : entry.items()) {
    if (key == "kind" || std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    throw bad_input(place.key(key).where, "is no key of this kind of anchor",
                    keys.empty() ? "no key but kind" : fmt::format("{}", fmt::join(keys, ", ")));
  }
}

}  // namespace

NetworkOptions parse_bonds(const Json& block, const DocumentPlace& place) {
  NetworkOptions options;
  options.support = block.value("support", options.support);
  if (!(options.support > 1.0 && options.support <= 4.0)) {
    throw bad_input(place.key("support").where, shortest(options.support),
                    "a number of spacings above 1, at most 4");
  }
  options.diagonals = block.value("diagonals", options.diagonals);
  read_word(block, "rule", kRuleWords, place, options.rule);
  read_word(block, "spacing_law", kSpacingLawWords, place, options.spacing_law);
  if (block.contains("reference_spacing")) {
    options.reference_spacing_m = quantity_at(block, "reference_spacing", Dimension::length, place);
    if (!(options.reference_spacing_m > 0.0)) {
      throw bad_input(place.key("reference_spacing").where,
                      fmt::format("{} m", shortest(options.reference_spacing_m)),
                      "a length above 0");
    }
  }
  return options;
}

LateralBond parse_lateral(const Json& block, const DocumentPlace& place) {
  LateralBond lateral = LateralBond::elastic;
  read_word(block, "lateral", kLateralWords, place, lateral);
  return lateral;
}

AnchorBlock parse_anchor(const Json& entry, const Organ& organ, const DocumentPlace& place) {
  const auto kind = entry.at("kind").get<std::string>();  // one of the schema's four
  AnchorBlock block;
  if (kind == "far_side") {
    require_keys(entry, {"fraction"}, place);
    block = far_side(entry, organ, place);
  } else if (kind == "inner_layer") {
    require_keys(entry, {}, place);
    block = inner_layer(organ);
  } else if (kind == "spheres") {
    require_keys(entry, {"spheres"}, place);
    block = named_spheres(entry, organ, place);
  } else {
    require_keys(entry, {"point", "normal"}, place);
    block = half_space(entry, organ, place);
  }
  if (block.spheres.empty()) {
    throw bad_input(place.where, "holds no sphere", "at least one sphere");
  }
  return block;
}

}  // namespace tpm::organ
