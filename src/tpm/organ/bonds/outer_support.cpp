#include "tpm/organ/bonds/outer_support.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

using Eigen::Index;

const double kSameFace = std::sqrt(3.0) / 2.0;  // cosine of 30 degrees
constexpr std::size_t kMostPlaces = 5;

/// What the spacing law multiplies every factor by.
double spacing_scale(const Network& network) {
  return network.options.spacing_law == SpacingLaw::continuum
             ? network.organ.spacing / network.options.reference_spacing_m
             : 1.0;
}

}  // namespace

std::vector<double> outer_support(const Network& network) {
  const Organ& organ = network.organ;
  std::vector<double> support(organ.size(), 0.0);
  for (const Bond& bond : network.bonds) {
    const auto a = static_cast<Index>(bond.a), b = static_cast<Index>(bond.b);
    const Eigen::Vector3d along = (organ.position.col(b) - organ.position.col(a)).normalized();
    const bool both_outer = organ.layer[bond.a] == 0 && organ.layer[bond.b] == 0;
    if (both_outer && organ.normal.col(a).dot(organ.normal.col(b)) > kSameFace) continue;
    for (const Index sphere : {a, b}) {
      const double cosine = along.dot(organ.normal.col(sphere));
      support[static_cast<std::size_t>(sphere)] += bond.factor * cosine * cosine;
    }
  }
  const double scale = spacing_scale(network);
  std::vector<double> outer;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == 0) outer.push_back(support[i] / scale);
  }
  return outer;
}

void require_outer_support(const Network& network, const Constraints& constraints,
                           std::string_view where) {
  const Organ& organ = network.organ;
  if (organ.layer_count() < 2) return;
  const std::vector<double> support = outer_support(network);
  std::string places;
  std::size_t found = 0, at = 0;
  double least = kLeastOuterSupport;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] != 0) continue;
    const double own = support[at++];
    const auto column = static_cast<Index>(i);
    const bool free = (constraints.projector(i) * organ.normal.col(column)).norm() > 1e-6;
    if (own >= kLeastOuterSupport || !free) continue;
    least = std::min(least, own);
    if (++found > kMostPlaces) continue;
    const Eigen::Vector3d place = 1e3 * organ.position.col(column);
    places += fmt::format("{}sphere {} at ({}, {}, {}) mm", found == 1 ? "" : ", ", i + 1,
                          significant(place.x(), 4), significant(place.y(), 4),
                          significant(place.z(), 4));
  }
  if (found == 0) return;
  if (found > kMostPlaces) places += fmt::format(" and {} more", found - kMostPlaces);
  throw bad_input(
      where,
      fmt::format("{} of {} outer spheres {} hardly held from inside: {}; least {} of the target "
                  "stiffness along the normal",
                  found, support.size(), found == 1 ? "is" : "are", places, significant(least, 2)),
      fmt::format("{} or more for each: smaller spheres where the body is thin, a wider support of "
                  "the bonds, or a shell",
                  shortest(kLeastOuterSupport)));
}

}  // namespace tpm::organ
