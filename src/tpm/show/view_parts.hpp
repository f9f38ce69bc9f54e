#pragma once
// Internal to report/: the kinds of files that view_file() shows.
#include <filesystem>
#include <string_view>
#include <vector>

#include "tpm/haptics/show/view_file.hpp"

namespace tpm::report {

/// @param bytes of the file, for its hash and for text
[[nodiscard]] ViewPage view_simulation(const std::filesystem::path& file, std::string_view bytes,
                                       const ViewOptions& options);
[[nodiscard]] ViewPage view_recording(const std::filesystem::path& file, std::string_view bytes,
                                      const ViewOptions& options);
[[nodiscard]] ViewPage view_fit(const std::filesystem::path& file, std::string_view bytes);

/// A page of this kind with what is known of every file: its name and its hash.
[[nodiscard]] ViewPage begun_page(std::string_view kind, const std::filesystem::path& file,
                                  std::string_view bytes);

/// Every so many states are shown, so that the page holds at most `most` numbers of a kind.
[[nodiscard]] std::size_t shown_stride(std::size_t states, std::size_t numbers_of_one,
                                       std::size_t most);

}  // namespace tpm::report
