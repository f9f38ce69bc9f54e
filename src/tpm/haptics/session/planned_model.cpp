#include "tpm/haptics/session/planned_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "tpm/base/text.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/haptics/session/pushed_scene.hpp"
#include "tpm/plan/plan.hpp"
#include "tpm/plan/plan_model.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

ContactRange range_of(const HilSession& session, double deepest_m) {
  ContactRange range;
  range.depth_m = deepest_m;
  range.hold_s = 0.0;
  double begin_s = 0.0;
  for (const SessionPhase& phase : session.phases) {
    const double length_s = phase.end_s - begin_s;
    begin_s = phase.end_s;
    range.speed_m_per_s = std::max(range.speed_m_per_s, phase.rate_m_per_s);
    switch (phase.kind) {
      case SessionPhaseKind::load:  // how deep a load goes is not known: at most so deep
        range.speed_m_per_s = std::max(range.speed_m_per_s, deepest_m / length_s);
        break;
      case SessionPhaseKind::hold:
      case SessionPhaseKind::creep:
        range.hold_s = std::max(range.hold_s, length_s);
        break;
      default:
        break;
    }
  }
  return range;
}

ExperimentScene scene_of(const PushedScene& pushed, const ContactRange& range) {
  ExperimentScene scene{pushed.tissue,
                        {pushed.contact},
                        Protocol(Drive::displacement, {{0.0, 0.0}, {1.0, range.depth_m}}, "push"),
                        {},
                        {},
                        {}};
  std::vector<Slider>& sliders = scene.tissue.sliders;
  for (const std::size_t sphere : spheres_of(pushed.contact, pushed.tissue.network.organ)) {
    const auto of_contact = [&](const Slider& slider) { return slider.sphere == sphere; };
    if (std::any_of(sliders.begin(), sliders.end(), of_contact)) continue;
    sliders.push_back({sphere, pushed.probe().direction});
  }
  return contact_scene(scene, range);
}

PlanRequest request_of(const HilSession& session, const PlanningTold& told) {
  PlanRequest request;
  request.progress = told;
  set_tolerance(request, session.tolerance);
  request.for_loop = true;
  request.relevance = request.changes = false;
  request.budget.rate_Hz = 1.0 / session.servo.period_s;
  return request;
}

std::string percent(double part) {
  return significant(100.0 * part, 3) + " %";
}

Json number_or_null(const std::optional<double>& number) {
  return number ? Json(*number) : Json();
}

Json json_of(const Plan& plan) {
  Json candidates = Json::array();
  for (const PlannedCandidate& c : plan.candidates) {
    candidates.push_back({{"name", c.name},
                          {"period_s", number_or_null(c.period_s)},
                          {"claimed_error", number_or_null(c.claimed_error)},
                          {"verified_error", number_or_null(c.verified_error)},
                          {"feasible", c.feasible},
                          {"reason", c.reason}});
  }
  return {{"tolerance", plan.request.tolerance},
          {"tolerance_source", plan.request.tolerance_source},
          {"rate_Hz", plan.request.budget.rate_Hz.value()},
          {"reference", plan.reference.method},
          {"peak_N", plan.reference.peak},
          {"masses_left_out", number_or_null(plan.masses_left_out)},
          {"choice", plan.chosen().name},
          {"candidates", std::move(candidates)}};
}

/// Error of a plan without an answer.
Error no_model(const Plan& plan) {
  const std::string instead =
      plan.without_budget
          ? fmt::format(
                "a lower rate or a wider tolerance: {} meets the tolerance and takes {} us "
                "a period",
                plan.candidates[*plan.without_budget].name,
                significant(1e6 * plan.candidates[*plan.without_budget].period_s.value(), 3))
          : "a wider tolerance";
  return {ExitCode::answer_is_no, "model",
          fmt::format("nothing that the loop steps is within {} of the peak at {} Hz",
                      percent(plan.request.tolerance),
                      significant(plan.request.budget.rate_Hz.value(), 4)),
          instead};
}

}  // namespace

LoopModel planned_model(const HilSession& session, const PlanningTold& told) {
  const PushedScene pushed(session);
  const ContactRange range = range_of(session, pushed.deepest_m);
  const ExperimentScene scene = scene_of(pushed, range);
  const Plan plan = make_plan(scene, request_of(session, told));
  if (!plan.choice) throw no_model(plan);
  const PlannedCandidate& chosen = plan.chosen();
  LoopModel loop = pushed.begun(chosen.name, "seen from");
  loop.name += fmt::format(
      "; picked by tpm plan: the cheapest within {} of the peak at {} Hz, pushed to {} mm at {} "
      "mm/s",
      percent(plan.request.tolerance), significant(plan.request.budget.rate_Hz.value(), 4),
      significant(1e3 * range.depth_m, 4), significant(1e3 * range.speed_m_per_s, 4));
  loop.error_bound = fmt::format(
      "at most {} of the peak of {} N on the planned motion, {} verified against the nonlinear "
      "network; on others tpm hil verify measures it",
      percent(chosen.claimed_error.value()), significant(plan.reference.peak, 3),
      percent(chosen.verified_error.value()));
  if (plan.masses_left_out) {
    loop.error_bound += fmt::format("; masses, which are left out, would change {}",
                                    percent(*plan.masses_left_out));
  } else if (!plan.masses_unknown.empty()) {
    loop.error_bound +=
        fmt::format("; not known what masses would change: {}", plan.masses_unknown);
  }
  loop.plan = json_of(plan);
  if (told) told("model for the loop");
  auto models = planned_contacts(plan, scene, std::array{session.servo.period_s, kDrawnEvery_s});
  loop.model = std::move(models.front());
  if (loop.model->spheres() > 0) loop.shape.field = std::move(models.back());
  return loop;
}

namespace {

/// For how many periods of its slowest push to a depth forces are outside a session's model.
/// The model is at rest after it.
int outside_validity_on_push(ContactModel& model, const HilSession& session,
                             const Eigen::Vector3d& push, double depth_m) {
  double slowest_m_per_s = std::numeric_limits<double>::infinity();
  for (const SessionPhase& phase : session.phases) {
    if (phase.rate_m_per_s > 0.0) {
      slowest_m_per_s = std::min(slowest_m_per_s, phase.rate_m_per_s);
    }
  }
  constexpr double kMostSteps = 2e4;  // slower pushes are looked at as one of so many periods
  const double periods = depth_m / (slowest_m_per_s * session.servo.period_s);
  const int steps = static_cast<int>(std::clamp(std::ceil(periods), 1.0, kMostSteps));
  int outside = 0;
  for (int i = 1; i <= steps; ++i) {
    if (!model.step(static_cast<double>(i) / steps * depth_m * push).valid) ++outside;
  }
  model.reset();
  return outside;
}

}  // namespace

LoopModel offered_loop(const Formulation& formulation, const HilSession& session) {
  const PushedScene pushed(session);
  const ExperimentScene scene = scene_of(pushed, range_of(session, pushed.deepest_m));
  const PlanSurrogate surrogate(PlanScene(scene), {}, false);
  PlanBudget budget;
  budget.rate_Hz = 1.0 / session.servo.period_s;
  std::string reason = "no candidate that a loop steps";
  std::optional<LoopModel> found;
  int fewest_outside = std::numeric_limits<int>::max();
  for (const auto& candidate : formulation.as<PlanOffer>()->candidates(surrogate.scene())) {
    if (!candidate->for_loop()) continue;
    if (const auto why = candidate->why_not(surrogate, budget)) {
      reason = *why;
      continue;
    }
    LoopModel loop = pushed.begun(candidate->name(), "seen from");
    loop.error_bound = "not verified beforehand; tpm hil verify measures it";
    auto models = candidate->contacts(surrogate, std::array{session.servo.period_s, kDrawnEvery_s});
    loop.model = std::move(models.front());
    if (loop.model->spheres() > 0) loop.shape.field = std::move(models.back());
    const int outside =
        outside_validity_on_push(*loop.model, session, pushed.probe().direction, pushed.deepest_m);
    if (outside >= fewest_outside) continue;
    fewest_outside = outside;
    found = std::move(loop);
    if (outside == 0) break;
  }
  if (found) return std::move(*found);
  throw bad_input(session.scene_place.where,
                  fmt::format("the model '{}' has no answer: {}", formulation.name(), reason),
                  fmt::format("one of {}, {}", kPlannedModel, formulations_that(for_sessions)));
}

}  // namespace tpm::haptics
