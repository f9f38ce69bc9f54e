#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/scene/refilled_scene.hpp"

namespace tpm::plan {

/// Request of a choice of the number of spheres.
struct SpheresRequest {
  double tolerance = 0.1;       ///< of the distance to the limit, in parts of its peak; 1e-3 to 0.5
  std::size_t most = 15'000;    ///< spheres that may be tried, 200 to 1,000,000
  std::function<void()> tried;  ///< told after each number of spheres
};

/// A number of spheres that was tried.
struct TriedSpheres {
  RefilledScene::Filling filling;
  double spacing_m = 0.0;
  std::optional<double> area_ratio;     ///< of patches: what their spheres stand for over their own
  std::optional<double> peak;           ///< of the response, N or m
  std::optional<double> claimed_error;  ///< distance to the limit, in parts of its peak
  double operations_s = 0.0;            ///< of its run, at nominal costs
  std::string reason;                   ///< why it was not run
};

/// Number of spheres that a scene needs.
struct SpheresPlan {
  SpheresRequest request;
  std::vector<TriedSpheres> tried;  ///< by rising number
  double limit_peak = 0.0;          ///< N or m
  double limit_uncertainty = 0.0;   ///< 95 %, in parts of it
  /// In `tried`: the fewest from which on all are within the tolerance.
  std::optional<std::size_t> choice;

  [[nodiscard]] const TriedSpheres& chosen() const { return tried.at(choice.value()); }
};

/// Runs the scene without masses with rising numbers of spheres and extrapolates the response to
/// spheres without size. At each instant a straight line in the spacing is fitted (faces and rims
/// are errors of first order), with weights of one over the spacing squared, since a rim lies
/// between two spheres wherever it is. Where patches press, the line has a third coefficient: of
/// the area that their spheres stand for, over that of the patch. A number of spheres claims its
/// largest distance to the limit over the protocol, and the 95 % uncertainty of the limit (Student)
/// from what the line leaves. Ends when the second fit in a row has found a number within the
/// tolerance.
///
/// Spacings are at most the radius of the smallest contact: below, nothing converges. A number
/// whose network does not stand is passed over, with the reason; where forces cannot be balanced,
/// more are not tried.
/// Throws Error(bad_input) where too few numbers up to the most can be run.
[[nodiscard]] SpheresPlan plan_spheres(const RefilledScene& scene, const SpheresRequest& request);

/// The limit of responses, and what is not known of it.
struct SpacingLimit {
  Eigen::VectorXd response;
  double uncertainty = 0.0;  ///< 95 %, the largest over all times
};
/// @param terms of the line, a row for each spacing: the spacing, 0 in the limit, and whatever else
/// is 0 there
/// @param responses a column for each spacing, more of them than terms and the limit
[[nodiscard]] SpacingLimit spacing_limit(const Eigen::MatrixXd& terms,
                                         const Eigen::MatrixXd& responses);

}  // namespace tpm::plan
