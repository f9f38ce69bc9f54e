#include "tpm/plan/spheres_plan.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/core/require.hpp"
#include "tpm/core/text.hpp"
#include "tpm/plan/plan_scene.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
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

}  // namespace

SpacingLimit spacing_limit(const Eigen::MatrixXd& terms, const Eigen::MatrixXd& responses) {
  Eigen::MatrixXd line(terms.rows(), terms.cols() + 1);
  line << Eigen::VectorXd::Ones(terms.rows()), terms;
  const Eigen::VectorXd weight = terms.col(0).cwiseInverse();
  line = weight.asDiagonal() * line;
  const Eigen::MatrixXd weighted = weight.asDiagonal() * responses.transpose();
  const Eigen::MatrixXd inverse = (line.transpose() * line).inverse();
  const Eigen::MatrixXd found = inverse * (line.transpose() * weighted);
  const auto freedom = static_cast<double>(line.rows() - line.cols());
  const double variance = (weighted - line * found).colwise().squaredNorm().maxCoeff() / freedom;
  const boost::math::students_t student(freedom);
  return {found.row(0).transpose(),
          boost::math::quantile(student, 0.975) * std::sqrt(variance * inverse(0, 0))};
}

SpheresPlan plan_spheres(const RefilledScene& scene, const SpheresRequest& request) {
  require_number(request.tolerance >= 1e-3 && request.tolerance <= 0.5, "spheres",
                 request.tolerance, "0.1 % to 50 % of the peak");
  SpheresPlan plan;
  plan.request = request;
  const ExperimentScene& own = scene.own();
  const double widest = smallest_radius(own);
  const std::vector<double> times =
      sampled_times(own.protocol, kTimesOfFillingPiece, kMostFillingTimes);
  QuasiStaticOptions options;
  options.tolerance = kFillingTolerance;

  std::vector<std::size_t> run;  // in plan.tried
  const Eigen::Index terms_of_line = patches_area_ratio(own) ? 2 : 1;
  const std::size_t fewest_runs = static_cast<std::size_t>(terms_of_line) + 1 + kFreedom;
  Eigen::MatrixXd terms(0, terms_of_line), responses(std::ssize(times), 0);
  bool found_before = false;
  for (const RefilledScene::Filling& filling : scene.fillings(kFewestSpheres, request.most)) {
    const double spacing = own.tissue.network.organ.spacing / filling.finer;
    if (spacing > widest || one_layer_of_many(scene, filling.finer)) continue;
    TriedSpheres& tried = plan.tried.emplace_back();
    tried.filling = filling;
    tried.spacing_m = spacing;
    try {
      const PlanScene filled(scene.scene(filling));
      tried.filling.spheres = filled.network().organ.size();
      tried.spacing_m = filled.network().organ.spacing;
      tried.area_ratio = patches_area_ratio(filled.scene());
      const Trajectory answer = filled.quasi_static(options, times, false);
      tried.operations_s = nominal_costs().seconds_of(answer.work);
      tried.peak = answer.response.cwiseAbs().maxCoeff();
      responses.conservativeResize(Eigen::NoChange, responses.cols() + 1);
      responses.rightCols(1) = answer.response;
    } catch (const Error& error) {
      if (error.code() != ExitCode::numerical && error.code() != ExitCode::bad_input) throw;
      tried.reason = error.what();
      if (request.tried) request.tried();
      if (error.code() == ExitCode::numerical) break;  // more spheres fail as well, after longer
      continue;
    }
    if (request.tried) request.tried();
    run.push_back(plan.tried.size() - 1);
    terms.conservativeResize(terms.rows() + 1, Eigen::NoChange);
    terms(terms.rows() - 1, 0) = tried.spacing_m;
    if (tried.area_ratio) terms(terms.rows() - 1, 1) = *tried.area_ratio - 1.0;
    if (run.size() < fewest_runs) continue;
    const SpacingLimit limit = spacing_limit(terms, responses);
    plan.limit_peak = limit.response.cwiseAbs().maxCoeff();
    plan.limit_uncertainty = limit.uncertainty / plan.limit_peak;
    plan.choice.reset();
    for (std::size_t i = 0; i < run.size(); ++i) {
      TriedSpheres& claims = plan.tried[run[i]];
      const auto column = responses.col(static_cast<Eigen::Index>(i));
      claims.claimed_error = (column - limit.response).cwiseAbs().maxCoeff() / plan.limit_peak +
                             plan.limit_uncertainty;
      if (*claims.claimed_error > request.tolerance) {
        plan.choice.reset();  // fewer that come nearer do so by luck
      } else if (!plan.choice) {
        plan.choice = run[i];
      }
    }
    if (plan.choice && found_before) break;
    found_before = plan.choice.has_value();
  }
  if (run.size() >= fewest_runs) return plan;
  std::string failed;
  for (const TriedSpheres& tried : plan.tried) {
    if (!tried.reason.empty())
      failed = fmt::format("; {}: {}", tried.filling.spheres, tried.reason);
  }
  throw bad_input(
      "spheres",
      fmt::format("{} numbers of spheres up to {} can be run with a spacing of at most {} mm, the "
                  "radius of the smallest contact{}",
                  run.size(), request.most, significant(1e3 * widest, 3), failed),
      fmt::format("at least {}: more spheres, or a wider contact", fewest_runs));
}

}  // namespace tpm::organ
