#include "tpmkit/device.hpp"

namespace tpm::haptics {

std::string_view word_of(ForcesOff cause) {
  switch (cause) {
    case ForcesOff::none:
      return "none";
    case ForcesOff::button:
      return "button";
    case ForcesOff::velocity:
      return "velocity";
    case ForcesOff::watchdog:
      return "watchdog";
    case ForcesOff::software:
      return "software";
    case ForcesOff::unplugged:
      return "unplugged";
    case ForcesOff::dead_man:
      return "dead man's switch";
    case ForcesOff::unknown:
      break;
  }
  return "unknown";
}

std::string_view word_of(DeviceLink link) {
  switch (link) {
    case DeviceLink::none:
      return "none";
    case DeviceLink::synchronous:
      return "synchronous";
    case DeviceLink::asynchronous:
      return "asynchronous";
    case DeviceLink::simulated:
      return "simulated";
    case DeviceLink::network:
      return "network";
    case DeviceLink::unknown:
      break;
  }
  return "unknown";
}

}  // namespace tpm::haptics
