// Declared in tpmkit/device.hpp.
#include "tpmkit/device.hpp"

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::haptics {

std::string_view to_string(ForcesOff cause) {
  static constexpr auto kNames = std::to_array<Word<ForcesOff>>({
      {ForcesOff::none, "none"},
      {ForcesOff::button, "button"},
      {ForcesOff::velocity, "velocity"},
      {ForcesOff::watchdog, "watchdog"},
      {ForcesOff::software, "software"},
      {ForcesOff::unplugged, "unplugged"},
      {ForcesOff::dead_man, "dead man's switch"},
  });
  return word_for(kNames, cause, "unknown");
}

std::string_view to_string(DeviceLink link) {
  static constexpr auto kNames = std::to_array<Word<DeviceLink>>({
      {DeviceLink::none, "none"},
      {DeviceLink::synchronous, "synchronous"},
      {DeviceLink::asynchronous, "asynchronous"},
      {DeviceLink::simulated, "simulated"},
      {DeviceLink::network, "network"},
  });
  return word_for(kNames, link, "unknown");
}

}  // namespace tpm::haptics
