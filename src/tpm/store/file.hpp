#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace tpm {

/// Whole file as bytes. Throws Error(bad_input) if it is missing, a directory, unreadable or empty.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

/// A device, a pipe or a socket: it is written into, and never replaced by a file of its name.
[[nodiscard]] bool is_device_or_pipe(const std::filesystem::path& path);

/// Throws Error(environment) if what has the name is no file that a result could replace: a folder,
/// a device or a pipe.
void require_replaceable(const std::filesystem::path& path);

/// Writes under a temporary name in the same folder, flushes to the disk and renames, so that a
/// reader sees the old file or the new one and a full disk leaves the old one alone; into a device
/// or pipe as it stands. Creates the parent folders. Throws Error(environment).
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// The folder that holds data/, configs/, schemas/ and scripts/: $TPMKIT_SHARE if set, else beside
/// the installed program, else the source tree that this build came from. Throws
/// Error(environment) if none of them has a data folder.
[[nodiscard]] std::filesystem::path share_dir();

/// SHA-256 of the bytes in lower-case hexadecimal; ties a result to the data that made it.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

}  // namespace tpm
