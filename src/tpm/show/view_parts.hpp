#pragma once
// Shared parts of the pages of all kinds of files.
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string_view>

#include "tpm/show/view_page.hpp"

namespace tpm::show {

struct ViewOptions {
  /// Recompute the organ of a recorded session from its motion: recordings hold no spheres.
  bool organ = true;
  /// Told while the organ of a recording is recomputed: pictures done, and of how many.
  std::function<void(std::size_t done, std::size_t total)> progress;
  /// Numbers of one kind that the page holds of an organ, 48 MB: states are left out evenly above.
  std::size_t most_numbers = 12'000'000;
  /// A recording with more samples is shown by the least and the largest value of equal parts, so
  /// that its page stays below 100 MB.
  std::size_t most_samples = 2'000'000;
};

/// A page of this kind with what is known of every file: its name and its hash.
[[nodiscard]] ViewPage begun_page(std::string_view kind, const std::filesystem::path& file,
                                  std::string_view bytes);

/// Every so many states are shown, so that the page holds at most `most` numbers of a kind.
[[nodiscard]] std::size_t shown_stride(std::size_t states, std::size_t numbers_of_one,
                                       std::size_t most);

}  // namespace tpm::show
