#pragma once
#include <string_view>

namespace tpm {

/// Version of the library, as in CMakeLists.txt.
[[nodiscard]] std::string_view version() noexcept;

}  // namespace tpm
