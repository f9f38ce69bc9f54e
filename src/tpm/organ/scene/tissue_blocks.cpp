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

AnchorBlock far_side(double fraction, const Organ& organ, const DocumentPlace& place) {
  if (!organ.contact) {
    throw bad_input(
        place.where, "far_side of an organ without a contact sphere",
        "a key landing in the organ, which says where the probe lands, or another kind of "
        "anchor");
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

AnchorBlock named_spheres(const AnchorKeys& entry, const Organ& organ, const DocumentPlace& place) {
  AnchorBlock block;
  const DocumentPlace list = place.key("spheres");
  for (const std::size_t number : entry.spheres) {
    block.spheres.push_back(
        sphere_of(number, organ, list.key(std::to_string(block.spheres.size()))));
  }
  const std::size_t count = entry.spheres.size();
  block.words = fmt::format("{} named sphere{}", count, count == 1 ? "" : "s");
  return block;
}

AnchorBlock half_space(const AnchorKeys& entry, const Organ& organ) {
  const Eigen::Vector3d normal = vector_of(entry.normal).stableNormalized();
  AnchorBlock block{beyond(organ, normal, normal.dot(vector_of(entry.point))), "a half-space"};
  if (entry.slides) {
    block.words = "a half-space along its normal";
    block.along = normal;
  }
  return block;
}

AnchorBlock spheres_of(const AnchorKeys& entry, const Organ& organ, const DocumentPlace& place) {
  switch (entry.kind) {
    case AnchorKind::far_side:
      return far_side(entry.fraction, organ, place);
    case AnchorKind::inner_layer:
      return inner_layer(organ);
    case AnchorKind::spheres:
      return named_spheres(entry, organ, place);
    case AnchorKind::half_space:
      break;
  }
  return half_space(entry, organ);
}

}  // namespace

const Block<BondKeys>& bonds_block() {
  using O = NetworkOptions;
  const auto of_options = [](const Key<O>& key) { return within(&BondKeys::options, key); };
  static const Block<BondKeys> block(
      "bonds", "which spheres are joined, and how stiff their bonds are",
      {of_options(key("support", &O::support, number({.least = 1.0, .most = 4.0, .above = true}),
                      "neighbours are within this many spacings")),
       of_options(key("diagonals", &O::diagonals, flag(), "false: one radial bond per sphere")),
       of_options(key("rule", &O::rule, word(kRuleWords), "stiffness of a bond")),
       with_default(key("spacing_law", &BondKeys::spacing_law, word(kSpacingLawWords),
                        "how stiffness follows the spacing; beside E: continuum"),
                    "paper"),
       of_options(key("reference_spacing", &O::reference_spacing_m,
                      quantity(Dimension::length, kAboveZero),
                      "where the continuum law has the paper's stiffness")),
       key("lateral", &BondKeys::lateral, word(kLateralWords),
           "lateral bonds pull and push, or only pull, or relax as the radial ones do")});
  return block;
}

const Kinds<AnchorKeys, AnchorKind>& anchor_kinds() {
  using K = AnchorKeys;
  static const Kinds<K, AnchorKind> kinds(
      {.name = "anchor", .sentence = "spheres that are fixed"}, &K::kind,
      {{AnchorKind::far_side,
        "far_side",
        "the side away from the probe",
        {key("fraction", &K::fraction, number({.least = 0.0, .most = 1.0, .above = true}),
             "of the organ's depth along the probe's axis")}},
       {AnchorKind::inner_layer, "inner_layer", "the innermost layer", {}},
       {AnchorKind::spheres,
        "spheres",
        "spheres by their numbers",
        {required(key("spheres", &K::spheres, list(sphere_type(), {.fewest = 1}),
                      "numbers of spheres"))}},
       {AnchorKind::half_space,
        "half_space",
        "the side of a plane that its normal points to",
        {required(key("point", &K::point, point_type(), "a point of the plane")),
         required(key("normal", &K::normal, direction(), "of the plane, to the fixed side")),
         key("slides", &K::slides, flag(),
             "true: only the motion along the normal is held, as on a smooth plate that they stick "
             "to")}}});
  return kinds;
}

AnchorBlock anchor_of(const AnchorKeys& entry, const Organ& organ, const DocumentPlace& place) {
  AnchorBlock block = spheres_of(entry, organ, place);
  if (block.spheres.empty()) {
    throw bad_input(place.where, "holds no sphere", "at least one sphere");
  }
  return block;
}

}  // namespace tpm::organ
