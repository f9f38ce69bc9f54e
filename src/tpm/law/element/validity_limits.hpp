#pragma once
#include <numbers>

namespace tpm::law {

/// Bounds beyond which a result is a picture rather than tissue (the paper, section 3.1).
inline constexpr double kValidIndentation_m = 0.010;   ///< "should remain within 10mm"
inline constexpr double kDamageIndentation_m = 0.012;  ///< liver is damaged (its reference 11)
inline constexpr double kValidTurning_rad = std::numbers::pi / 6.0;  ///< of a lateral bond

}  // namespace tpm::law
