#pragma once
#include <string>

#include "hil_scenes.hpp"
#include "refusal.hpp"
#include "stand_in_inverse.hpp"
#include "tpm/haptics/inverse/inverse_device.hpp"
#include "tpm/haptics/session/session_run.hpp"

/// Sessions with --device inverse3 on the stand-in service.
namespace tpm::test::inverse_sessions {

using test::refusal_of;

/// The short session within the limits of the device, on a tissue of half the stiffness.
inline Json inverse_session() {
  Json json = short_session();
  for (const char* modulus : {"E1", "E2", "Eprime"}) {
    json["model"]["scene"]["material"][modulus] = "6 kPa";
  }
  json["model"]["scene"]["material"]["eta1"] = "1.2e4 Pa s";
  json["limits"] = {{"force", "3 N"}};
  return json;
}

/// With a plant that is later by some milliseconds.
inline PlantSettings plant_of(const HilSession& session, int late_ms) {
  PlantSettings plant = session.plant;
  plant.period_s = session.servo.period_s;
  plant.push = session.servo.push;
  plant.delay_periods = late_ms;
  return plant;
}

inline DeviceChoice choice_of(const StandInInverse& service) {
  DeviceChoice choice;
  choice.kind = "inverse3";
  choice.inverse = service.address();
  return choice;
}

/// Message with which a device on such a service cannot be opened.
inline std::string refusal(const StandInFaults& faults, const std::string& id = {}) {
  StandInInverse service(PlantSettings{}, {}, false, faults);
  InverseDevice device(service.address(id), limits_of("inverse3"));
  return refusal_of([&] { (void)device.open(); });
}

}  // namespace tpm::test::inverse_sessions
