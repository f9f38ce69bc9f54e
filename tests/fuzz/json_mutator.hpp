#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace tpm::fuzz {

/// A JSON document with one value removed, doubled, moved to another place, or replaced by one that
/// readers trip over. Deterministic for a seed.
/// @returns an empty text if `document` is no JSON, or is nested more than 100 deep
[[nodiscard]] std::string mutated_json(std::string_view document, std::uint32_t seed);

}  // namespace tpm::fuzz
