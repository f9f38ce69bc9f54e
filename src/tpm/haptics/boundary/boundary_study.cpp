#include "tpm/haptics/boundary/boundary_study.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/work/progress.hpp"

namespace tpm::haptics {
namespace {

constexpr double kRates_Hz[] = {500.0, 1000.0, 2000.0, 4000.0};
constexpr int kDelays[] = {0, 1, 2, 5, 10, 20, 50};
constexpr double kFrictions[] = {0.1, 0.3, 1.0};

BoundaryPoint point_of(const RenderedContact& contact, double damping) {
  return {
      1.0 / contact.period_s, contact.delay_periods, damping, contact.relaxation_time_s, 0.0, 0.0};
}

void vary_rate_and_delay(BoundaryStudy& study) {
  Progress progress("boundaries", std::size(kRates_Hz) * std::size(kDelays));
  for (const double rate : kRates_Hz) {
    for (const int delay : kDelays) {
      RenderedContact contact;
      contact.period_s = 1.0 / rate;
      contact.delay_periods = delay;
      contact.relaxation_time_s = study.relaxation_time_s;
      for (const double friction : kFrictions) {
        BoundaryPoint p = point_of(contact, friction);
        p.measured = largest_passive_stiffness(contact, friction, BoundaryBy::measurement);
        p.predicted = largest_passive_stiffness(contact, friction, BoundaryBy::prediction);
        study.passive.push_back(p);
      }
      BoundaryPoint p = point_of(contact, study.plant.damping_N_s_per_m);
      p.measured = largest_stable_stiffness(contact, study.plant, BoundaryBy::measurement);
      p.predicted = largest_stable_stiffness(contact, study.plant, BoundaryBy::prediction);
      study.stable.push_back(p);
      progress.advance();
    }
  }
}

void vary_relaxation_time(BoundaryStudy& study) {
  constexpr double kPeriods[] = {0.05, 0.1, 0.208, 0.3, 0.45, 0.55,
                                 0.7,  1.0, 2.0,   5.0, 20.0, 100.0};
  for (const ElementRule rule :
       {ElementRule::exact, ElementRule::forward_euler, ElementRule::mass_spring}) {
    for (const double periods : kPeriods) {
      RenderedContact contact;
      contact.rule = rule;
      contact.stiffness_N_per_m = study.stiffness_N_per_m;
      contact.relaxation_time_s = periods * contact.period_s;
      study.rules.push_back({rule, contact.relaxation_time_s, measured_passive_damping(contact),
                             predicted_passive_damping(contact)});
    }
  }
}

void find_shortest(BoundaryStudy& study) {
  for (const double rate : kRates_Hz) {
    for (const ElementRule rule : {ElementRule::forward_euler, ElementRule::exact}) {
      RenderedContact contact;
      contact.rule = rule;
      contact.period_s = 1.0 / rate;
      contact.stiffness_N_per_m = study.stiffness_N_per_m;
      const double friction = study.plant.damping_N_s_per_m;
      BoundaryPoint p = point_of(contact, friction);
      p.measured = smallest_passive_relaxation_time(contact, friction, BoundaryBy::measurement);
      p.predicted = smallest_passive_relaxation_time(contact, friction, BoundaryBy::prediction);
      (rule == ElementRule::exact ? study.shortest_exact : study.shortest).push_back(p);
    }
  }
}

/// One hand against one contact, with the loop of a session.
void run_impact(const RenderedContact& contact, const PlantSettings& plant, RiseLimit limit,
                ImpactPoint& point) {
  constexpr double kDepth_m = 4e-3, kBefore_m = 2e-3, kHeld_s = 5.0, kCompared_s = 0.5;
  // Ten steps of the encoder, within which a constant force cannot settle.
  constexpr double kAtRest_m = 1e-4;
  const double period_s = contact.period_s, speed = point.speed_m_per_s;
  const double pressed_s = (kDepth_m + kBefore_m) / speed, end_s = pressed_s + kHeld_s;
  PlantSettings settings = plant;
  settings.period_s = period_s;
  settings.delay_periods = contact.delay_periods;
  settings.arm.correction_per_s = 0.0;  // the hand holds, and does not chase a depth
  settings.velocity_limit_m_per_s = std::numeric_limits<double>::infinity();
  ServoSettings servo;
  servo.period_s = period_s;
  servo.phase_ends = {static_cast<std::uint64_t>(std::llround(end_s / period_s))};
  servo.friction_N_s_per_m = settings.damping_N_s_per_m;
  servo.delay_periods = contact.delay_periods;
  servo.energy_allowance_J = std::numeric_limits<double>::infinity();
  servo.watch_oscillation = false;
  servo.most_damping_N_s_per_m = 0.0;
  servo.most_speed_m_per_s = std::numeric_limits<double>::infinity();
  servo.ramp_in_s = limit == RiseLimit::ramp_in ? 0.5 + pressed_s : 0.0;
  if (limit == RiseLimit::none) {
    servo.slew_limit_N_per_s = servo.force_limit_N = 1e12;
    settings.motor_limit_N = 1e12;
  }
  VirtualOmega7 device(settings,
                       OperatorScript({{OperatorPiece::Aim::place, pressed_s, -kBefore_m, kDepth_m},
                                       {OperatorPiece::Aim::place, 1e9, kDepth_m, kDepth_m}}));
  DevicePreparation preparation;
  device.prepare(preparation);
  device.enable_forces();
  ElementContact model = contact.model();
  ServoStep step(device, model, servo);
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  const auto compared_from = static_cast<std::uint64_t>((end_s - kCompared_s) / period_s);
  ServoRecord row;
  while (step.cycle(0, row) == StopCause::none) {
    device.advance(period_s);
    if (row.cycle < compared_from) continue;
    low_m = std::min(low_m, row.tool_depth_m);
    high_m = std::max(high_m, row.tool_depth_m);
  }
  const auto which = static_cast<std::size_t>(limit);
  point.rests[which] = step.cause() == StopCause::finished && high_m - low_m < kAtRest_m;
  point.delivered_J[which] = step.energy().most_delivered_J();
}

void vary_impact(BoundaryStudy& study) {
  constexpr double kSpeeds_m_per_s[] = {0.01, 0.03, 0.1, 0.3, 1.0};
  constexpr double kShares[] = {0.25, 0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 4.0};
  constexpr int kImpactDelays[] = {0, 1, 2, 5, 10};
  Progress progress("hands against contacts", std::size(kImpactDelays) * std::size(kShares));
  for (const int delay : kImpactDelays) {
    RenderedContact contact;
    contact.delay_periods = delay;
    contact.relaxation_time_s = study.relaxation_time_s;
    const double boundary = largest_stable_stiffness(contact, study.plant, BoundaryBy::prediction);
    for (const double share : kShares) {
      for (const double speed : kSpeeds_m_per_s) {
        ImpactPoint point;
        point.delay_periods = delay;
        point.speed_m_per_s = speed;
        point.share = share;
        point.stiffness_N_per_m = contact.stiffness_N_per_m = share * boundary;
        for (const RiseLimit limit : kRiseLimits) run_impact(contact, study.plant, limit, point);
        study.impacts.push_back(point);
      }
      progress.advance();
    }
  }
}

void list_corners(BoundaryStudy& study) {
  constexpr double kPeriod_s = 1e-3;
  study.corners = {{"omega.7", 5000.0, 30.0, 0.0, 0.0, std::pair{0.1, 1.0}},
                   {"lambda.7", 8000.0, 30.0, 0.0, 0.0, std::nullopt},
                   {"Falcon", 3000.0, 20.0, 0.0, 0.0, std::nullopt},
                   {"Omni", 700.0, 5.0, 0.0, 0.0, std::nullopt},
                   {"Touch", 400.0, 4.0, 0.0, 0.0, std::nullopt}};
  for (DeviceCorner& corner : study.corners) {
    const double k = corner.stiffness_N_per_m, b = corner.damping_N_s_per_m;
    corner.needed_N_s_per_m = 0.5 * k * kPeriod_s + b;
    corner.needed_delayed_N_s_per_m = 1.5 * k * kPeriod_s + b;
  }
}

}  // namespace

std::string_view to_string(RiseLimit limit) {
  switch (limit) {
    case RiseLimit::slip:
      return "slip";
    case RiseLimit::ramp_in:
      return "slip and ramp-in";
    case RiseLimit::none:
      break;
  }
  return "none";
}

BoundaryStudy study_boundaries(const PlantSettings& plant) {
  BoundaryStudy study;
  study.plant = plant;
  vary_rate_and_delay(study);
  vary_relaxation_time(study);
  find_shortest(study);
  vary_impact(study);
  list_corners(study);
  return study;
}

}  // namespace tpm::haptics
