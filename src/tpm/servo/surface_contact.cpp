#include "tpm/servo/surface_contact.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/core/error.hpp"

namespace tpm {
namespace {

/// Between neighbours the squares of the weights add up to more than this; less is an edge, where
/// the shares fade instead of being scaled up.
constexpr double kEdge = 0.25;
/// A surface so close to where it rests has recovered.
constexpr double kRecovered_m = 1e-9;

}  // namespace

SurfaceContact::SurfaceContact(std::vector<SurfacePlace> places,
                               const SurfaceContactOptions& options)
    : options_(options) {
  if (!(options.reach_m > 0.0 && std::isfinite(options.reach_m))) {
    throw bad_input("surface", "the reach is not above 0", "the distance of neighbours");
  }
  bool answers = false;
  places_.reserve(places.size());
  for (SurfacePlace& place : places) {
    Place& own = places_.emplace_back();
    own.rest_m = place.rest_m;
    own.into = place.into.normalized();
    own.model = std::move(place.model);
    if (!own.model) continue;
    own.contact = std::make_unique<OneSidedContact>(*own.model, own.into);
    answers = true;
  }
  if (!answers) throw bad_input("surface", "no place has a model", "at least one");
  reset();
}

void SurfaceContact::reset() noexcept {
  for (Place& place : places_) {
    place.awake = false;
    if (place.contact) place.contact->reset();
  }
}

double SurfaceContact::weigh(const Eigen::Vector3d& tool_m, Eigen::Vector3d& slope) noexcept {
  const double reach2 = options_.reach_m * options_.reach_m;
  double sum = 0.0;
  Eigen::Vector3d sum_slope = Eigen::Vector3d::Zero();
  for (Place& place : places_) {
    const Eigen::Vector3d from = tool_m - place.rest_m;
    const double along = place.into.dot(from);
    const Eigen::Vector3d aside = from - along * place.into;
    const double left = 1.0 - aside.squaredNorm() / reach2;
    // Farther along its normal than aside it may be felt: another side of the organ.
    const bool near = left > 0.0 && std::abs(along) < 2.0 * options_.reach_m +
                                                          options_.tool_radius_m +
                                                          options_.sphere_radius_m;
    place.weight = near ? left * left : 0.0;
    place.weight_slope = near ? Eigen::Vector3d(-4.0 * left / reach2 * aside)
                              : Eigen::Vector3d(Eigen::Vector3d::Zero());
    sum += place.weight * place.weight;
    sum_slope += 2.0 * place.weight * place.weight_slope;
  }
  past_edge_ = sum < kEdge;
  if (!past_edge_) {
    slope = sum_slope;
    return sum;
  }
  slope = sum / kEdge * sum_slope;
  return 0.5 * (kEdge + sum * sum / kEdge);
}

SurfaceContact::Answer SurfaceContact::step(const Eigen::Vector3d& tool_m) noexcept {
  Eigen::Vector3d divided_slope;
  const double divided = weigh(tool_m, divided_slope);
  const double root = std::sqrt(divided);
  Answer answer;
  for (Place& place : places_) {
    const double share = place.weight / root;
    const double below =
        place.into.dot(tool_m - place.rest_m) + options_.tool_radius_m + options_.sphere_radius_m;
    place.depth_m = share * below;
    answer.depth_m += share * place.depth_m;
    if (!place.contact) {
      if (place.depth_m > 0.0) answer.trusted = false;
      continue;
    }
    // Written so that a place that is no number wakes it, and is passed on.
    place.awake = place.awake || !(place.depth_m <= 0.0);
    if (!place.awake) continue;
    ++answer.awake;
    const OneSidedContact::Answer one = place.contact->step(place.depth_m);
    const Eigen::Vector3d slope =
        share * place.into +
        below * (place.weight_slope / root - 0.5 * share / divided * divided_slope);
    answer.force_N -= one.force_N * slope;
    answer.error_N += share * one.error_N;
    answer.trusted = answer.trusted && one.trusted;
    if (one.touching) {
      ++answer.touching;
    } else if (std::abs(one.surface_m) < kRecovered_m && place.depth_m <= 0.0) {
      place.contact->reset();  // what it still stores is given up: less energy, never more
      place.awake = false;
    }
  }
  if (past_edge_ && answer.touching > 0) answer.trusted = false;
  return answer;
}

}  // namespace tpm
