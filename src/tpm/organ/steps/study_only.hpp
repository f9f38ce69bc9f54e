#pragma once
#include <algorithm>
#include <array>
#include <string_view>

namespace tpm::organ {

/// True if a formulation is there for studies of step rules alone, and no scene should choose it:
/// explicit rules, whose stability limits the step on stiff tissue whatever accuracy is asked for
/// (docs/accuracy.md).
[[nodiscard]] inline bool is_study_only(std::string_view formulation) {
  constexpr std::array<std::string_view, 4> kExplicit{"forward_euler", "semi_implicit_euler", "rk4",
                                                      "cvode_adams"};
  return std::find(kExplicit.begin(), kExplicit.end(), formulation) != kExplicit.end();
}

}  // namespace tpm::organ
