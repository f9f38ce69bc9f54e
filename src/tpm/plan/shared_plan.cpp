#include "tpm/plan/shared_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/plan/scalar_run.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr double kUnitDepth_m = 1e-3;    // of the grid; the next is sqrt(2) times deeper
constexpr double kHoldOfLongest = 10.0;  // of a hold that leaves nothing to relax
constexpr double kStepsOfRamp = 64.0;
// Of a run for claims; most take less than 200. Where E2 is 1000 E1 the long creep takes 20,000,
// far more than the cells that claims are to spare: nothing is claimed there.
constexpr double kMostIterations = 600.0;
// Counted in runs of the network: two at each place of the grid and the judging of the models; the
// two static curves of a depth; the spectrum.
constexpr double kRunsOfPlace = 3.0, kRunsOfDepth = 3.0, kRunsOfSpectrum = 3.0;

/// A ramp from rest and a hold.
struct RampAndHold {
  double depth_m = 0.0, ramp_s = 0.0;
};

std::optional<RampAndHold> as_ramp_and_hold(const Protocol& protocol) {
  const auto knots = protocol.knots();
  const bool is_one = protocol.drive() == Drive::displacement && !protocol.equilibrium_at_start() &&
                      (knots.size() == 2 || knots.size() == 3) && knots[0].value == 0.0 &&
                      knots[0].time_s == 0.0 && knots[1].value > 0.0 && knots[1].time_s > 0.0 &&
                      knots.back().value == knots[1].value;
  if (!is_one) return std::nullopt;
  return RampAndHold{knots[1].value, knots[1].time_s};
}

ExperimentScene with_unit_relaxation(ExperimentScene scene) {
  set_value(scene.tissue.materials.materials.front(), "tau1", 1.0, "shared plan");
  return scene;
}

double longest_run_s(const PlanScene& scene) {
  return kMostIterations * nominal_costs().seconds_of(newton_iteration_work(scene.driven()));
}

double depth_of_place(int place) {
  return kUnitDepth_m * std::exp2(0.5 * place);
}

int next_deeper(double depth_m) {
  int place = static_cast<int>(std::floor(2.0 * std::log2(depth_m / kUnitDepth_m)));
  while (depth_of_place(place) < depth_m) ++place;
  return place;
}

/// All of a history in a shorter or longer time.
Protocol in_units_of(const Protocol& protocol, double tau_s) {
  std::vector<Knot> knots(protocol.knots().begin(), protocol.knots().end());
  for (Knot& knot : knots) knot.time_s /= tau_s;
  return {protocol.drive(), std::move(knots), protocol.name()};
}

Eigen::VectorXd response_of(ScalarRun run, const std::vector<double>& times_s, double& steps) {
  Eigen::VectorXd response(std::ssize(times_s));
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    response[static_cast<Eigen::Index>(i)] = run.at(times_s[i]);
  }
  steps = run.steps();
  return response;
}

}  // namespace

SharedPlan::SharedPlan(const ExperimentScene& scene, double tolerance)
    : scene_(with_unit_relaxation(scene)), tolerance_(tolerance) {}

const std::vector<std::string>& SharedPlan::models() {
  static const std::vector<std::string> names{"linear_1", "linear_2", "linear_3", "curves_1",
                                              "curves_2"};
  return names;
}

double SharedPlan::cost_in_runs(double depths, double lengths) {
  const double deep = std::ceil(2.0 * std::log2(std::max(depths, 1.0))) + 1.0;
  const double along = std::ceil(std::log2(std::max(lengths, 1.0))) + 2.0;
  return kRunsOfSpectrum + deep * (kRunsOfDepth + along * kRunsOfPlace);
}

const SharedPlan::OfDepth& SharedPlan::of_depth(int place) {
  const auto found = of_depth_.find(place);
  if (found != of_depth_.end()) return found->second;
  OfDepth made;
  try {
    const ContactSpectrum& spectrum = spectrum_at_rest(scene_);
    const double depth = depth_of_place(place);
    const PlanSurrogate surrogate(scene_.with_protocol(ramp_and_hold(depth, depth, 0.0)), {}, false,
                                  longest_run_s(scene_));
    const ContactCurves& curves = surrogate.curves();
    for (const int branches : {1, 2, 3}) {
      made.models.push_back(linear_contact(spectrum, branches));
    }
    for (const int branches : {1, 2}) {
      made.models.push_back(curves_contact(curves, spectrum, branches));
    }
  } catch (const Error& error) {
    if (error.code() == ExitCode::environment) throw;
    made.models.clear();  // so deep the network fails or takes too long: nothing is claimed
  }
  return of_depth_.emplace(place, std::move(made)).first->second;
}

const std::vector<double>& SharedPlan::claims_at(Place place) {
  const auto found = claims_.find(place);
  if (found != claims_.end()) return found->second;
  std::vector<double> claims(models().size(), std::numeric_limits<double>::infinity());
  const OfDepth& here = of_depth(place.first);
  if (!here.models.empty()) try {
      const double depth = depth_of_place(place.first), ramp = std::exp2(place.second);
      const double hold = kHoldOfLongest * spectrum_at_rest(scene_).longest_s;
      const PlanSurrogate surrogate(scene_.with_protocol(ramp_and_hold(depth, depth / ramp, hold)),
                                    {}, false, longest_run_s(scene_));
      for (std::size_t m = 0; m < claims.size(); ++m) {
        Trajectory answer;
        answer.response = response_of(
            ScalarRun(surrogate.scene().protocol(), here.models[m], ramp / kStepsOfRamp, true),
            surrogate.times(), answer.steps);
        claims[m] = surrogate.claim_of(answer);
      }
    } catch (const Error& error) {
      if (error.code() == ExitCode::environment) throw;
    }
  return claims_.emplace(place, std::move(claims)).first->second;
}

std::optional<SharedAnswer> SharedPlan::answer(const Protocol& protocol, double tau_s,
                                               const std::vector<double>& times_s) {
  const auto shape = as_ramp_and_hold(protocol);
  if (!shape || !scene_.single_sphere()) return std::nullopt;
  const int depth = next_deeper(shape->depth_m);
  const double length = shape->ramp_s / tau_s;
  const int shorter = static_cast<int>(std::floor(std::log2(length)));
  SharedAnswer answer;
  std::optional<ScalarModel> model;
  {
    const std::scoped_lock lock(one_at_a_time_);
    const std::vector<double>& low = claims_at({depth, shorter});
    const std::vector<double>& high = claims_at({depth, shorter + 1});
    while (answer.model < models().size()) {
      answer.claim = std::max(low[answer.model], high[answer.model]);
      if (answer.claim <= tolerance_) break;
      ++answer.model;
    }
    if (answer.model == models().size()) return std::nullopt;
    model = of_depth(depth).models[answer.model];
  }
  const Protocol scaled = in_units_of(protocol, tau_s);
  std::vector<double> times = times_s;
  for (double& t : times) t /= tau_s;
  answer.response = response_of(ScalarRun(scaled, std::move(*model), length / kStepsOfRamp, true),
                                times, answer.steps);
  return answer;
}

}  // namespace tpm::plan
