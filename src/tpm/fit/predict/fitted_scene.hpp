#pragma once
#include <optional>

#include "tpm/files/json.hpp"
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// An organ with the material that a fit found, ready for tpm simulate, plan and sweep, and a
/// session for tpm hil run that steps its network.
struct FittedScene {
  Json scene, session;
};

/// The scene of a fit with "model": "organ". The first material gets the fitted values; regions
/// stay. Where the paper's element was fitted with another spacing, the organ is built at it. The
/// protocol is a ramp to the largest fitted depth and a hold, the contact the organ's sphere. None
/// if no organ was fitted. A spring-pot is written as the branches that stand for it.
[[nodiscard]] std::optional<FittedScene> fitted_scene(const FitResult& fit);

}  // namespace tpm::fit
