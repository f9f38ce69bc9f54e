#include "tpm/haptics/border_study.hpp"

namespace tpm {
namespace {

constexpr double kRates_Hz[] = {500.0, 1000.0, 2000.0, 4000.0};
constexpr int kDelays[] = {0, 1, 2, 5};
constexpr double kFrictions[] = {0.1, 0.3, 1.0};

BorderPoint point_of(const RenderedContact& contact, double damping) {
  return {
      1.0 / contact.period_s, contact.delay_periods, damping, contact.relaxation_time_s, 0.0, 0.0};
}

void vary_rate_and_delay(BorderStudy& study) {
  for (const double rate : kRates_Hz) {
    for (const int delay : kDelays) {
      RenderedContact contact;
      contact.period_s = 1.0 / rate;
      contact.delay_periods = delay;
      contact.relaxation_time_s = study.relaxation_time_s;
      for (const double friction : kFrictions) {
        BorderPoint p = point_of(contact, friction);
        p.measured = largest_passive_stiffness(contact, friction, BorderBy::measurement);
        p.predicted = largest_passive_stiffness(contact, friction, BorderBy::prediction);
        study.passive.push_back(p);
      }
      BorderPoint p = point_of(contact, study.plant.damping_N_s_per_m);
      p.measured = largest_stable_stiffness(contact, study.plant, BorderBy::measurement);
      p.predicted = largest_stable_stiffness(contact, study.plant, BorderBy::prediction);
      study.stable.push_back(p);
    }
  }
}

void vary_relaxation_time(BorderStudy& study) {
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

void find_shortest(BorderStudy& study) {
  for (const double rate : kRates_Hz) {
    for (const ElementRule rule : {ElementRule::forward_euler, ElementRule::exact}) {
      RenderedContact contact;
      contact.rule = rule;
      contact.period_s = 1.0 / rate;
      contact.stiffness_N_per_m = study.stiffness_N_per_m;
      const double friction = study.plant.damping_N_s_per_m;
      BorderPoint p = point_of(contact, friction);
      p.measured = smallest_passive_relaxation_time(contact, friction, BorderBy::measurement);
      p.predicted = smallest_passive_relaxation_time(contact, friction, BorderBy::prediction);
      (rule == ElementRule::exact ? study.shortest_exact : study.shortest).push_back(p);
    }
  }
}

}  // namespace

BorderStudy study_borders(const PlantSettings& plant) {
  BorderStudy study;
  study.plant = plant;
  vary_rate_and_delay(study);
  vary_relaxation_time(study);
  find_shortest(study);
  return study;
}

}  // namespace tpm
