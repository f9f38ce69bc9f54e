#pragma once
#include <cstdint>
#include <string>

#include "tpm/files/json.hpp"

namespace tpm::test {

/// Message of a client that presses buttons of the simulated grip of tpm hil serve, and lets go of
/// the others. @param buttons bit 0 is a
inline std::string press_message(std::uint32_t buttons) {
  files::Json pressed;
  std::uint32_t bit = 1;
  for (const char* name : {"a", "b", "c"}) {
    pressed[name] = (buttons & bit) != 0;
    bit <<= 1U;
  }
  const files::Json grip{{"device_id", "SIMULATED_GRIP"}, {"commands", {{"set_buttons", pressed}}}};
  return files::Json{{"wireless_verse_grip", files::Json::array({grip})}}.dump();
}

}  // namespace tpm::test
