#include "tpm/organ/bonds/outer_support.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
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
constexpr double kNoHold = 1e-12;  // of the target: a stiffness below is none

/// Factor of the spacing law.
double spacing_scale(const Network& network) {
  return network.options.spacing_law == SpacingLaw::continuum
             ? network.organ.spacing / network.options.reference_spacing_m
             : 1.0;
}

/// Spheres that are told, the first few with their places.
class ToldPlaces {
 public:
  void add(std::size_t sphere, const Positions& position) {
    if (++count_ > kMostPlaces) return;
    const Eigen::Vector3d place = 1e3 * position.col(static_cast<Index>(sphere));
    words_ += fmt::format("{}sphere {} at ({}, {}, {}) mm", count_ == 1 ? "" : ", ", sphere + 1,
                          significant(place.x(), 4), significant(place.y(), 4),
                          significant(place.z(), 4));
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::string words() const {
    return count_ > kMostPlaces ? fmt::format("{} and {} more", words_, count_ - kMostPlaces)
                                : words_;
  }

 private:
  std::size_t count_ = 0;
  std::string words_;
};

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
  ToldPlaces places;
  std::size_t at = 0;
  double least = kLeastOuterSupport;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] != 0) continue;
    const double own = support[at++];
    const auto column = static_cast<Index>(i);
    const bool free = (constraints.projector(i) * organ.normal.col(column)).norm() > 1e-6;
    if (own >= kLeastOuterSupport || !free) continue;
    least = std::min(least, own);
    places.add(i, organ.position);
  }
  if (places.count() == 0) return;
  throw bad_input(
      where,
      fmt::format("{} of {} outer spheres {} hardly held from inside: {}; least {} of the target "
                  "stiffness along the normal",
                  places.count(), support.size(), places.count() == 1 ? "is" : "are",
                  places.words(), significant(least, 2)),
      fmt::format("{} or more for each: smaller spheres where the body is thin, a wider support of "
                  "the bonds, or a shell",
                  shortest(kLeastOuterSupport)));
}

std::vector<double> least_hold(const Network& network, const Constraints& constraints) {
  const Organ& organ = network.organ;
  std::vector<Eigen::Matrix3d> held(organ.size(), Eigen::Matrix3d::Zero());
  for (const Bond& bond : network.bonds) {
    const Eigen::Vector3d along = (organ.position.col(static_cast<Index>(bond.b)) -
                                   organ.position.col(static_cast<Index>(bond.a)))
                                      .normalized();
    const Eigen::Matrix3d stiffness = bond.factor * along * along.transpose();
    held[bond.a] += stiffness;
    held[bond.b] += stiffness;
  }
  const double scale = spacing_scale(network);
  std::vector<double> least(organ.size());
  for (std::size_t i = 0; i < organ.size(); ++i) {
    // Fixed spheres count as held by the target.
    const Eigen::Matrix3d& p = constraints.projector(i);
    const Eigen::Matrix3d own = p * (held[i] / scale) * p + Eigen::Matrix3d::Identity() - p;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(own, Eigen::EigenvaluesOnly);
    const double found = solver.eigenvalues().minCoeff();
    least[i] = found > kNoHold ? found : 0.0;
  }
  return least;
}

void require_hold(const Network& network, const Constraints& constraints, std::string_view where) {
  const Organ& organ = network.organ;
  if (organ.layer_count() < 2) return;
  const std::vector<double> hold = least_hold(network, constraints);
  ToldPlaces places;
  double least = kLeastHold;
  for (std::size_t i = 0; i < hold.size(); ++i) {
    if (hold[i] >= kLeastHold) continue;
    least = std::min(least, hold[i]);
    places.add(i, organ.position);
  }
  if (places.count() == 0) return;
  throw bad_input(
      where,
      fmt::format(
          "{} hardly held in some direction: {}; least {} of the target stiffness",
          places.count() == 1 ? "1 sphere is" : fmt::format("{} spheres are", places.count()),
          places.words(), significant(least, 2)),
      fmt::format("{} or more for each: smaller spheres where the body is thin, a wider support of "
                  "the bonds, or a shell",
                  shortest(kLeastHold)));
}

}  // namespace tpm::organ
