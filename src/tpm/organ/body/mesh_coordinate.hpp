#pragma once
#include <array>
#include <optional>
#include <string_view>

namespace tpm::organ {

/// Mark that may stand in front of a text in UTF-8.
inline constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";

/// A corner of a mesh as its file states it: single precision, the precision of binary STL.
using MeshCorner = std::array<float, 3>;

/// A coordinate of a text file ("-1.5", "2e-3", also "0,5") in single precision: the sum of its
/// whole part and of up to 15 decimals, each rounded. So it can differ in the last bit from the
/// nearest single; spheres of a scene are placed from it, and another rounding would move them all.
/// None for any other text, and for what is not finite.
[[nodiscard]] std::optional<float> find_mesh_coordinate(std::string_view word);

/// The line of a byte of a text, from 1. LF, CRLF and CR end a line.
[[nodiscard]] int line_of_byte(std::string_view text, std::size_t byte);

}  // namespace tpm::organ
