#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/view_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// Most results of a folder on one page: each holds its arrays.
inline constexpr std::size_t kMostResultsOfPage = 50;

/// Folders below each other that are looked into, under the one that is viewed.
inline constexpr int kFoldersBelow = 3;

/// A file that tpm view does not show, or a folder of recordings.
struct NotShown {
  std::filesystem::path file;
  Error reason;  ///< what it is, and what shows it
};

/// The results in a folder, as their content tells them.
struct FolderResults {
  std::vector<std::filesystem::path> shown;  ///< fits first, then by name
  std::vector<NotShown> not_shown;
};

/// Looks at the files of a folder and of kFoldersBelow folders below it. What the page of a fit or
/// a validation shows anyway, its law, figures and tables, is no result of its own. A damaged file
/// is not shown, nor is a table that may be a recording.
[[nodiscard]] FolderResults results_in(const std::filesystem::path& folder);

/// The page of a path.
struct Viewed {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> names;  ///< of these files, within the folder; of a fit its folder's
  std::vector<ViewPage> pages;     ///< of these files
  std::vector<NotShown> not_shown;

  /// One page; it lists the results if there are several files.
  [[nodiscard]] std::string html() const;
};

/// Reads a file (view_file()), or all results in a folder. Throws Error(bad_input) for a folder
/// without a result or with more than kMostResultsOfPage.
[[nodiscard]] Viewed view_path(const std::filesystem::path& path, const ViewOptions& options = {});

/// Reads a result of `tpm simulate`, a recording of `tpm hil run`, a fit (law.json, figures.json or
/// the JSON answer of `tpm fit`) or a validation (validation.json) as the page that shows it. What
/// the file is, its bytes say, not its name. Throws Error(bad_input) for any other file, and what
/// the readers and make_loop_model() throw.
[[nodiscard]] ViewPage view_file(const std::filesystem::path& file,
                                 const ViewOptions& options = {});
}  // namespace tpm::haptics
