#include "tpm/plan/spheres_plan.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/base/distributions.hpp"
#include "tpm/base/require.hpp"
#include "tpm/base/text.hpp"
#include "tpm/plan/plan_scene.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr std::size_t kFewestSpheres = 50;
constexpr std::size_t kFreedom = 2;         // degrees that a fit leaves at least
constexpr double kFillingTolerance = 1e-4;  // of a run, in parts of its peak
constexpr int kTimesOfFillingPiece = 16, kMostFillingTimes = 64;

double smallest_radius(const ExperimentScene& scene) {
  double radius = std::numeric_limits<double>::infinity();
  for (const SceneContact& contact : scene.contacts) radius = std::min(radius, contact.radius_m);
  return radius;
}

/// A shell of one layer bends without resistance: it is no coarse version of a thicker one.
bool one_layer_of_many(const RefilledScene& scene, double finer) {
  const int layers = scene.own().tissue.network.organ.layer_count();
  return layers > 1 && std::round(layers * finer) < 2.0;
}

/// Each sphere of the outer layer stands for its cell of a triangular lattice.
std::optional<double> patches_area_ratio(const ExperimentScene& scene) {
  double stands_for = 0.0, own = 0.0;
  const Organ& organ = scene.tissue.network.organ;
  const double cell = 0.5 * std::sqrt(3.0) * organ.spacing * organ.spacing;
  for (const SceneContact& contact : scene.contacts) {
    if (contact.kind != ContactKind::patch) continue;
    stands_for += cell * static_cast<double>(spheres_of(contact, organ).size());
    own += std::numbers::pi * contact.radius_m * contact.radius_m;
  }
  if (own == 0.0) return std::nullopt;
  return stands_for / own;
}

/// Runs fillings and keeps what they claim.
class SpheresSearch {
 public:
  SpheresSearch(const RefilledScene& scene, const SpheresRequest& request)
      : scene_(scene),
        times_(sampled_times(scene.own().protocol, kTimesOfFillingPiece, kMostFillingTimes)),
        terms_(0, patches_area_ratio(scene.own()) ? 2 : 1),
        responses_(std::ssize(times_), 0) {
    plan_.request = request;
  }

  /// True if the next one is to be tried.
  [[nodiscard]] bool run(const RefilledScene::Filling& filling) {
    TriedSpheres tried;
    tried.filling = filling;
    tried.spacing_m = scene_.own().tissue.network.organ.spacing / filling.finer;
    bool balanced = true;
    try {
      answer(tried);
      ran_.push_back(plan_.tried.size());
    } catch (const Error& error) {
      if (error.code() != ExitCode::numerical && error.code() != ExitCode::bad_input) throw;
      tried.reason = error.what();
      balanced = error.code() == ExitCode::bad_input;  // else more fail as well, after longer
    }
    plan_.tried.push_back(std::move(tried));
    if (plan_.request.tried) plan_.request.tried();
    if (!plan_.tried.back().reason.empty()) return balanced;
    const bool found_before = plan_.choice.has_value();
    if (enough()) claim();
    return !(plan_.choice && found_before);
  }

  /// Throws Error(bad_input) if too few were run.
  SpheresPlan take(double widest_m) {
    if (enough()) return std::move(plan_);
    std::string failed;
    for (const TriedSpheres& t : plan_.tried) {
      if (!t.reason.empty()) failed = fmt::format("; {}: {}", t.filling.spheres, t.reason);
    }
    throw bad_input(
        "spheres",
        fmt::format("{} numbers of spheres up to {} can be run with a spacing of at "
                    "most {} mm, the radius of the smallest contact{}",
                    ran_.size(), plan_.request.most, significant(1e3 * widest_m, 3), failed),
        fmt::format("at least {}: more spheres, or a wider contact", fewest()));
  }

 private:
  [[nodiscard]] std::size_t fewest() const {
    return static_cast<std::size_t>(terms_.cols()) + 1 + kFreedom;
  }
  [[nodiscard]] bool enough() const { return ran_.size() >= fewest(); }

  void answer(TriedSpheres& tried) {
    const PlanScene filled(scene_.scene(tried.filling));
    tried.filling.spheres = filled.network().organ.size();
    tried.spacing_m = filled.network().organ.spacing;
    tried.area_ratio = patches_area_ratio(filled.scene());
    QuasiStaticOptions options;
    options.tolerance = kFillingTolerance;
    const Trajectory found = filled.quasi_static(options, times_, false);
    tried.operations_s = nominal_costs().seconds_of(found.work);
    tried.peak = found.response.cwiseAbs().maxCoeff();
    responses_.conservativeResize(Eigen::NoChange, responses_.cols() + 1);
    responses_.rightCols(1) = found.response;
    terms_.conservativeResize(terms_.rows() + 1, Eigen::NoChange);
    terms_(terms_.rows() - 1, 0) = tried.spacing_m;
    if (tried.area_ratio) terms_(terms_.rows() - 1, 1) = *tried.area_ratio - 1.0;
  }

  void claim() {
    const SpacingLimit limit = spacing_limit(terms_, responses_);
    plan_.limit_peak = limit.response.cwiseAbs().maxCoeff();
    plan_.limit_uncertainty = limit.uncertainty / plan_.limit_peak;
    plan_.choice.reset();
    for (std::size_t i = 0; i < ran_.size(); ++i) {
      const auto response = responses_.col(static_cast<Eigen::Index>(i));
      const double error = (response - limit.response).cwiseAbs().maxCoeff() / plan_.limit_peak +
                           plan_.limit_uncertainty;
      plan_.tried[ran_[i]].claimed_error = error;
      if (error > plan_.request.tolerance) {
        plan_.choice.reset();  // fewer that come nearer do so by luck
      } else if (!plan_.choice) {
        plan_.choice = ran_[i];
      }
    }
  }

  const RefilledScene& scene_;
  std::vector<double> times_;
  SpheresPlan plan_;
  std::vector<std::size_t> ran_;       ///< of plan_.tried
  Eigen::MatrixXd terms_, responses_;  ///< a row, a column for each of them
};

}  // namespace

SpacingLimit spacing_limit(const Eigen::MatrixXd& terms, const Eigen::MatrixXd& responses) {
  Eigen::MatrixXd line(terms.rows(), terms.cols() + 1);
  line << Eigen::VectorXd::Ones(terms.rows()), terms;
  const Eigen::VectorXd weight = terms.col(0).cwiseInverse();
  line = weight.asDiagonal() * line;
  if (Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(line.colwise().normalized()).rank() <
      line.cols()) {
    throw Error(ExitCode::numerical, "spheres", "the terms of the line are linearly dependent",
                "spacings and areas that differ");
  }
  const Eigen::MatrixXd weighted = weight.asDiagonal() * responses.transpose();
  const Eigen::MatrixXd inverse = (line.transpose() * line).inverse();
  const Eigen::MatrixXd found = inverse * (line.transpose() * weighted);
  const auto freedom = static_cast<double>(line.rows() - line.cols());
  const double variance = (weighted - line * found).colwise().squaredNorm().maxCoeff() / freedom;
  return {found.row(0).transpose(),
          student_quantile(0.975, freedom) * std::sqrt(variance * inverse(0, 0))};
}

SpheresPlan plan_spheres(const RefilledScene& scene, const SpheresRequest& request) {
  require_number(request.tolerance >= 1e-3 && request.tolerance <= 0.5, "spheres",
                 request.tolerance, "0.001 to 0.5 of the peak, such as 0.1 or 10%");
  const double widest = smallest_radius(scene.own());
  SpheresSearch search(scene, request);
  for (const RefilledScene::Filling& filling : scene.fillings(kFewestSpheres, request.most)) {
    const double spacing = scene.own().tissue.network.organ.spacing / filling.finer;
    if (spacing > widest || one_layer_of_many(scene, filling.finer)) continue;
    if (!search.run(filling)) break;
  }
  return search.take(widest);
}

}  // namespace tpm::plan
