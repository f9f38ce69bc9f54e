#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>

#include "tpm/show/view_page.hpp"

namespace tpm::report {

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

/// Reads a result of `tpm simulate`, a recording of `tpm hil run` or a fit (law.json, figures.json
/// or the JSON answer of `tpm fit`) as the page that shows it. What the file is, its bytes say, not
/// its name. Throws Error(bad_input) for any other file, and what the readers and
/// make_loop_model() throw.
[[nodiscard]] ViewPage view_file(const std::filesystem::path& file,
                                 const ViewOptions& options = {});
}  // namespace tpm::report
