#pragma once
#include <string_view>

namespace tpm::organ {

/// The most exponentials of a reduced contact, by its formulation: files may ask for so many, and
/// plans try so many.
[[nodiscard]] constexpr int most_exponentials(std::string_view formulation) {
  return formulation == "curves" ? 2 : 3;
}

}  // namespace tpm::organ
