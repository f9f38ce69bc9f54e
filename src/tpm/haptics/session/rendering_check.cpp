#include "tpm/haptics/session/rendering_check.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/base/text.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/session/rendering_boundary.hpp"
#include "tpm/haptics/session/six_hands.hpp"

namespace tpm::haptics {
namespace {

constexpr double kAtLoads_m = 0.010;
constexpr double kNever_s = 1e6;  ///< a spring that never relaxes may be worse than one that does

/// Change of the force within one period by a motion at a depth, N/m, on the tool against the
/// motion; empty outside the validity of the model.
std::optional<Eigen::Vector3d> tangent_at(ContactModel& model, const Eigen::Vector3d& push,
                                          double depth_m, const Eigen::Vector3d& motion) {
  constexpr int kSteps = 200;
  constexpr double kFurther_m = 5e-5;
  model.reset();
  ContactAnswer there;
  for (int i = 1; i <= kSteps; ++i) there = model.step(push * (depth_m * i / kSteps));
  const ContactAnswer stays = model.step(push * depth_m);
  const ContactAnswer further = model.step(push * depth_m + motion * kFurther_m);
  if (!stays.valid || !further.valid) return std::nullopt;
  // Relaxation in a period is left out: it also occurred in the period before.
  const Eigen::Vector3d equilibrium_N = stays.force_N - there.force_N;
  return (stays.force_N - further.force_N + equilibrium_N) / kFurther_m;
}

/// Of all directions in which the tool may move.
double largest_stiffness(const Eigen::Matrix3d& stiffness) {
  const Eigen::Matrix3d symmetric = 0.5 * (stiffness + stiffness.transpose());
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues()
      .maxCoeff();
}

/// Largest stiffness within one period at a depth: along the push, or of all directions if the
/// tool moves in space. 0 outside the validity of the model.
double stiffness_at(ContactModel& model, const LoopModel& loop, double depth_m) {
  if (!loop.to_model) {
    const auto along = tangent_at(model, loop.push, depth_m, loop.push);
    return along ? loop.push.dot(*along) : 0.0;
  }
  Eigen::Matrix3d stiffness;
  for (int i = 0; i < 3; ++i) {
    const auto column = tangent_at(model, loop.push, depth_m, Eigen::Vector3d::Unit(i));
    if (!column) return 0.0;
    stiffness.col(i) = *column;
  }
  return largest_stiffness(stiffness);
}

void find_stiffness(RenderingCheck& check, const HilSession& session, ContactModel& model,
                    const LoopModel& loop) {
  constexpr int kDepths = 4;
  const auto size_of = [&loop](const Eigen::Matrix3d& stiffness) {
    return loop.to_model ? largest_stiffness(stiffness) : loop.push.dot(stiffness * loop.push);
  };
  const double at_rest = size_of(model.instantaneous_stiffness());
  const double relaxed = size_of(model.equilibrium_stiffness());
  check.stiffness_N_per_m = at_rest;
  check.equilibrium_share = at_rest > 0.0 ? std::clamp(relaxed / at_rest, 0.0, 1.0) : 1.0;
  const double deepest = deepest_asked_m(session, kAtLoads_m);
  for (int i = 1; i <= kDepths; ++i) {
    const double depth = deepest * i / kDepths;
    const double tangent = stiffness_at(model, loop, depth);
    if (!(tangent > check.stiffness_N_per_m)) continue;
    check.stiffness_N_per_m = tangent;
    check.depth_m = depth;
  }
  model.reset();
}

RenderedContact contact_of(const RenderingCheck& check, double relaxation_time_s) {
  RenderedContact contact;
  contact.period_s = 1.0 / check.rate_Hz;
  contact.delay_periods = check.delay_periods;
  contact.relaxation_time_s = relaxation_time_s;
  contact.stiffness_N_per_m = check.stiffness_N_per_m;
  contact.equilibrium_share = check.equilibrium_share;
  return contact;
}

/// Delay and friction that count.
void count_device(RenderingCheck& check, const HilSession& session, const DeviceLimits& limits) {
  const double period_s = session.servo.period_s;
  const double stated_s = session.plant.delay_periods * period_s;
  if (limits.hardware()) {
    check.delay_measured = limits.measured_delay_s.has_value();
    const double known_s = check.delay_measured ? *limits.measured_delay_s +
                                                      std::max(period_s, limits.measured_period_s)
                                                : kUnmeasuredDelay_s;
    check.delay_s = std::max(known_s, stated_s);
    check.longest_delay_s = kLongestDelay_s + std::max(period_s, limits.measured_period_s);
    // A device of which nobody measured the delay counts as one of which nothing is known.
    check.friction_N_s_per_m =
        check.delay_measured ? limits.measured_friction_N_s_per_m.value_or(0.0) : 0.0;
    if (session.stated_friction_N_s_per_m) {
      check.friction_N_s_per_m =
          std::min(check.friction_N_s_per_m, *session.stated_friction_N_s_per_m);
    }
  } else {
    // The simulated Omega.7 is what the session says; a simulated plugin speaks for itself.
    check.delay_s = limits.simulated ? limits.delay_periods * period_s : stated_s;
    check.friction_N_s_per_m =
        limits.simulated ? limits.friction_N_s_per_m : session.plant.damping_N_s_per_m;
  }
  constexpr double kRounding = 1e-9;
  check.delay_periods = static_cast<int>(std::ceil(check.delay_s / period_s - kRounding));
}

/// Rests that are too short for what comes after them.
void warn_of_rests(RenderingCheck& check, const HilSession& session) {
  constexpr double kLeft = 0.01;
  const double needed_s = -std::log(kLeft) * check.recovery_s;
  double begin_s = 0.0, shortest_s = 0.0;
  for (const SessionPhase& phase : session.phases) {
    const double length_s = phase.end_s - begin_s;
    begin_s = phase.end_s;
    const bool last = &phase == &session.phases.back();
    if (phase.kind != SessionPhaseKind::rest || last) continue;
    if (shortest_s == 0.0 || length_s < shortest_s) shortest_s = length_s;
  }
  if (shortest_s == 0.0 || shortest_s >= needed_s) return;
  check.remarks.push_back(
      {"rest_too_short",
       fmt::format("a rest of {} s is too short: the surface recovers with a time constant of {} "
                   "s, so that {} "
                   "% of what is left of an indentation is still there at the next one, whose "
                   "force is smaller "
                   "by that; {} s leave 1 %",
                   significant(shortest_s, 3), significant(check.recovery_s, 3),
                   significant(100.0 * std::exp(-shortest_s / check.recovery_s), 2),
                   significant(needed_s, 3))});
}

/// Stiffness, delay and friction that count.
std::string what_counts(const RenderingCheck& check) {
  const std::string delay = significant(1e3 * check.delay_s, 3);
  const std::string not_measured =
      check.delay_measured
          ? std::string()
          : fmt::format(" ({}: {} ms and no friction count)",
                        check.delay_note.empty() ? "not measured on this device" : check.delay_note,
                        delay);
  return fmt::format("stiffness {} N/m at {} Hz, {} ms of delay{}, friction {} N s/m",
                     significant(check.stiffness_N_per_m, 3), significant(check.rate_Hz, 4), delay,
                     not_measured, significant(check.friction_N_s_per_m, 2));
}

}  // namespace

std::string RenderingCheck::refusal(bool accept_unstable) const {
  const std::string what = what_counts(*this);
  if (unstable() && !accept_unstable) {
    return fmt::format(
        "unstable: {}; stable with the operator's arm up to {} N/m, of which {} % are allowed",
        what, significant(stable_N_per_m, 3), significant(100.0 * kRoom, 2));
  }
  if (!stable() && !accept_unstable) {
    return fmt::format(
        "stable with the operator's arm, but with too little margin: {}; at most {} N/m, which is "
        "{} % of the {} N/m at which it becomes unstable",
        what, significant(kRoom * stable_N_per_m, 3), significant(100.0 * kRoom, 2),
        significant(stable_N_per_m, 3));
  }
  if (!within_device()) {
    return fmt::format("too stiff for the device: {}; at most {} N/m", what,
                       significant(largest_N_per_m, 3));
  }
  if (!follows_encoder()) {
    return fmt::format(
        "the rise of the force is limited too much: {}; a step of the encoder ({} mm) makes {} N, "
        "limits/slew_N_per_s allows {} N within a period and has to be {} at least",
        what, significant(1e3 * encoder_step_m, 2),
        significant(stiffness_N_per_m * encoder_step_m, 3), significant(rise_N, 3),
        significant(stiffness_N_per_m * encoder_step_m * rate_Hz, 3));
  }
  if (!safe_in_hands() && !accept_unstable) {
    return fmt::format(
        "a weakly damped hand would receive energy: {}; at most {} N/m keep six hands below {} "
        "mJ{}",
        what, significant(hands_N_per_m, 3), significant(1e3 * kMostIntoHand_J, 2),
        delay_measured ? "" : "; tpm hil identify measures the delay");
  }
  if (!delay_is_guarded()) {
    return fmt::format("the delay is longer than any that is guarded: {}; measured at most {} ms",
                       what, significant(1e3 * kLongestDelay_s, 3));
  }
  return {};
}

std::optional<RenderingCondition> RenderingCheck::unmet(bool accept_unstable) const {
  if (!stable() && !accept_unstable) return RenderingCondition::stability;
  if (!within_device()) return RenderingCondition::device_stiffness;
  if (!follows_encoder()) return RenderingCondition::slew_limit;
  if (!safe_in_hands() && !accept_unstable) return RenderingCondition::stability;
  if (!delay_is_guarded()) return RenderingCondition::delay;
  return std::nullopt;
}

std::string_view to_string(RenderingCondition condition) {
  switch (condition) {
    case RenderingCondition::stability:
      return "stability";
    case RenderingCondition::device_stiffness:
      return "stiffness limit of the device";
    case RenderingCondition::slew_limit:
      return "slew limit";
    case RenderingCondition::delay:
      break;
  }
  return "delay";
}

std::string_view remedy(RenderingCondition condition) {
  switch (condition) {
    case RenderingCondition::stability:
      return "a softer tissue, a higher rate, a shorter delay or a faster rise";
    case RenderingCondition::device_stiffness:
      return "a softer tissue";
    case RenderingCondition::slew_limit:
      return "a faster rise (limits/slew_N_per_s) or a softer tissue";
    case RenderingCondition::delay:
      break;
  }
  return "a device with a shorter delay";
}

std::string RenderingCheck::verdict() const {
  if (std::string refused = refusal(false); !refused.empty()) return refused;
  const std::string what = what_counts(*this);
  if (!passive()) {
    return fmt::format(
        "stable with the operator's arm (up to {} N/m), not passive: {}; passive with every "
        "operator up to {} N/m; of six hands stable with: {}",
        significant(stable_N_per_m, 3), what, significant(passive_N_per_m, 3), stable_hands);
  }
  return fmt::format("passive: {}; the boundary is {} N/m, that of stability {} N/m", what,
                     significant(passive_N_per_m, 3), significant(stable_N_per_m, 3));
}

RenderingCheck check_rendering(const HilSession& session, ContactModel& model,
                               const LoopModel& loop, std::string_view kind) {
  return check_rendering(session, model, loop, limits_of(kind));
}

RenderingCheck check_rendering(const HilSession& session, ContactModel& model,
                               const LoopModel& loop, const DeviceLimits& limits) {
  const bool own = limits.hardware() || limits.simulated;
  RenderingCheck check;
  if (session.law && session.law->adequacy && !session.law->adequacy->is_adequate()) {
    check.remarks.push_back({"law_in_doubt", "law: " + session.law->adequacy->summary});
  }
  check.rate_Hz = 1.0 / session.servo.period_s;
  count_device(check, session, limits);
  check.largest_N_per_m = limits.stiffness_N_per_m;
  check.encoder_step_m = own ? limits.encoder_step_m
                         : limits.plant
                             ? std::max(session.plant.encoder_step_m, limits.encoder_step_m)
                             : session.plant.encoder_step_m;
  check.rise_N = session.servo.slew_limit_N_per_s * session.servo.period_s;
  find_stiffness(check, session, model, loop);

  const double period_s = session.servo.period_s;
  const double late_s = 0.5 * period_s + check.delay_s;
  check.passive_friction_N_s_per_m = check.stiffness_N_per_m * late_s;
  check.passive_N_per_m = check.friction_N_s_per_m / late_s;
  check.hands_N_per_m =
      largest_stiffness_for_hands(check.delay_s, check.friction_N_s_per_m, period_s);
  check.stable_hands = hands_that_are_stable(contact_of(check, kNever_s), check.friction_N_s_per_m);

  check.recovery_s = loop.relaxation_times_s.empty()
                         ? 0.0
                         : loop.relaxation_times_s.back() / std::max(check.equilibrium_share, 1e-3);
  PlantSettings plant = session.plant;
  plant.damping_N_s_per_m = check.friction_N_s_per_m;
  check.stable_N_per_m = 1e300;
  std::vector<double> times_s = loop.relaxation_times_s;
  times_s.push_back(kNever_s);
  for (const double relaxation_s : times_s) {
    const RenderedContact contact = contact_of(check, relaxation_s);
    check.spectral_radius = std::max(check.spectral_radius, loop_spectral_radius(contact, plant));
    check.stable_N_per_m = std::min(
        check.stable_N_per_m, largest_stable_stiffness(contact, plant, BoundaryBy::prediction));
  }
  warn_of_rests(check, session);
  return check;
}

Json to_json(const RenderingCheck& check) {
  constexpr int kDigits = 6;
  Json json{{"verdict", check.verdict()},
            {"stable", check.stable()},
            {"unstable", check.unstable()},
            {"passive", check.passive()},
            {"within_device", check.within_device()},
            {"follows_encoder", check.follows_encoder()},
            {"rate_Hz", rounded(check.rate_Hz, kDigits)},
            {"safe_in_hands", check.safe_in_hands()},
            {"delay_measured", check.delay_measured},
            {"delay_guarded", check.delay_is_guarded()},
            {"delay_s", rounded(check.delay_s, kDigits)},
            {"delay_periods", check.delay_periods},
            {"friction_N_s_per_m", rounded(check.friction_N_s_per_m, kDigits)},
            {"stiffness_N_per_m", rounded(check.stiffness_N_per_m, kDigits)},
            {"at_depth_m", rounded(check.depth_m, kDigits)},
            {"passive_friction_N_s_per_m", rounded(check.passive_friction_N_s_per_m, kDigits)},
            {"passive_boundary_N_per_m", rounded(check.passive_N_per_m, kDigits)},
            {"stable_boundary_N_per_m", rounded(check.stable_N_per_m, kDigits)},
            {"spectral_radius", rounded(check.spectral_radius, kDigits)},
            {"device_boundary_N_per_m", rounded(check.largest_N_per_m, kDigits)},
            {"hands_boundary_N_per_m", rounded(check.hands_N_per_m, kDigits)},
            {"stable_hands", check.stable_hands},
            {"remarks", remarks_json(check.remarks)}};
  if (check.delay_at_start_s) {
    json["delay_at_start_s"] = rounded(*check.delay_at_start_s, kDigits);
  }
  return json;
}

}  // namespace tpm::haptics
