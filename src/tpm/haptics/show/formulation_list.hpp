#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"

namespace tpm::haptics {

/// All formulations with what they can do: name, meaning, capabilities, keys in scenes, sessions.
[[nodiscard]] Json formulations_json();
[[nodiscard]] std::string formulations_text();

/// The shapes of materials with their parameters, and whether they run at servo rate.
[[nodiscard]] Json shapes_json();
[[nodiscard]] std::string shapes_text();

}  // namespace tpm::haptics
