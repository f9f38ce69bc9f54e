#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "tpmkit/error.hpp"

namespace tpm::files {

/// No text or mesh that a person hands over is larger; what has no end (/dev/zero) is.
inline constexpr std::uint64_t kLargestInput = std::uint64_t{1} << 30U;

/// Whole file as bytes. Throws Error(bad_input) if it is missing, a directory, unreadable, empty or
/// larger than `most` bytes.
[[nodiscard]] std::string read_file(const std::filesystem::path& path,
                                    std::uint64_t most = kLargestInput);

/// A device, a pipe, a socket, or a name of an open stream such as /dev/stdout: it is written into,
/// and never replaced by a file of its name.
[[nodiscard]] bool is_device_or_pipe(const std::filesystem::path& path);

/// Throws Error(environment) if what has the name is no file that a result could replace: a folder,
/// a device or a pipe.
void require_replaceable(const std::filesystem::path& path);

/// Why a file could not be opened for reading: bad_input if it lies in the file (rights), else
/// environment (no descriptors left, a disk that fails).
[[nodiscard]] Error cannot_read(const std::filesystem::path& path, int error_number);

/// "PATH: cannot write: REASON", of an errno.
[[nodiscard]] Error cannot_write(const std::filesystem::path& path, int error_number);

/// Writes all bytes; false with errno if that is not possible.
[[nodiscard]] bool write_all(int descriptor, std::string_view bytes);
/// Reads `size` bytes from a place of a file on. How many there were, fewer only at its end; none
/// with errno if reading fails.
[[nodiscard]] std::optional<std::size_t> pread_all(int descriptor, void* to, std::size_t size,
                                                   std::uint64_t from);
/// Writes `size` bytes from a place of a file on. How many were written, fewer only with errno.
[[nodiscard]] std::size_t pwrite_all(int descriptor, const void* from, std::size_t size,
                                     std::uint64_t to);

/// Writes through a Replacement (replacement.hpp) and flushes to the disk, so that a reader sees
/// the old file or the new one and a full disk leaves the old one alone; into a device or pipe as
/// it stands. Creates the parent folders. Throws Error(environment).
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// The folder that holds data/, configs/, schemas/ and scripts/: $TPMKIT_SHARE if set, else beside
/// the installed program, else the source tree that this build came from. Throws
/// Error(environment) if none of them has a data folder.
[[nodiscard]] std::filesystem::path share_dir();

/// A page of share_dir()/pages as one file, with pages/drawing.js in it. Throws Error(environment)
/// if either is missing or damaged.
[[nodiscard]] std::string read_page(std::string_view name);

/// SHA-256 of the bytes in lower-case hexadecimal; ties a result to the data that made it.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

}  // namespace tpm::files
