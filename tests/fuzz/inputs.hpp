#pragma once
#include <filesystem>
#include <span>
#include <string_view>

namespace tpm::fuzz {

/// A kind of file from outside, and what reads it.
struct Input {
  std::string_view name;
  std::string_view ending;                          ///< of the file's name, with its dot
  void (*read)(const std::filesystem::path& path);  ///< throws tpm::Error for a bad file
};

[[nodiscard]] std::span<const Input> inputs();

/// Throws Error(usage) for a name that is not there.
[[nodiscard]] const Input& input_named(std::string_view name);

/// Writes the bytes to a file in the folder and reads it. A tpm::Error is an answer; whatever else
/// is thrown, or ends the process, is a finding.
/// @returns whether the file was taken
bool reads(const Input& input, const std::filesystem::path& folder, std::string_view bytes);

}  // namespace tpm::fuzz
