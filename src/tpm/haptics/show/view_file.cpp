#include "tpm/haptics/show/view_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <tuple>

#include "tpm/base/lists.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/fit/show/view_fit.hpp"
#include "tpm/haptics/show/view_recording.hpp"
#include "tpm/plan/show/view_simulation.hpp"

namespace tpm::haptics {
namespace fs = std::filesystem;
namespace {

constexpr const char* kShownFiles =
    "a result of tpm simulate (HDF5), a recording of tpm hil run, or law.json, figures.json or "
    "the JSON answer of tpm fit";

/// Kind of a file by its first bytes.
enum class FirstBytes { json, hdf5, rows, other };

FirstBytes first_bytes(std::string_view bytes) {
  constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n", kRows = "TPMROWS1";
  if (bytes.starts_with(kHdf5)) return FirstBytes::hdf5;
  if (bytes.starts_with(kRows)) return FirstBytes::rows;
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string::npos && bytes[first] == '{' ? FirstBytes::json : FirstBytes::other;
}

/// Without telling anyone that the file was read: most files of a folder are nothing to view, and
/// one of them may be the page that is written.
FirstBytes first_bytes_of(const fs::path& file) {
  constexpr std::size_t kLooked = 64;
  std::string bytes(kLooked, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), kLooked);
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return first_bytes(bytes);
}

/// The order on the page.
enum class ResultKind { answer, law, figures, simulation, recording, none };

/// Throws Error(bad_input) for what tpm view does not show.
ResultKind result_kind(const fs::path& file) {
  switch (first_bytes_of(file)) {
    case FirstBytes::rows:
      return ResultKind::recording;
    case FirstBytes::hdf5:
      if (const auto other = plan::other_than_simulation(Hdf5Reader(file), file)) {
        throw bad_input(file.string(), other->what, other->expected);
      }
      return ResultKind::simulation;
    case FirstBytes::json:
      switch (fit::fit_file(read_json(file))) {
        case fit::FitFile::answer:
          return ResultKind::answer;
        case fit::FitFile::law:
          return ResultKind::law;
        case fit::FitFile::figures:
          return ResultKind::figures;
        case fit::FitFile::none:
          break;
      }
      break;
    case FirstBytes::other:
      break;
  }
  return ResultKind::none;
}

struct FoundResult {
  ResultKind kind{};
  fs::path file;
};

/// True of what stands on the page of another result: figures.json on that of a law or an answer,
/// law.json on that of the answer that tpm fit wrote beside it.
bool is_part_of(const FoundResult& part, const FoundResult& whole) {
  const bool answer = whole.kind == ResultKind::answer && fit::is_answer_of_folder(whole.file);
  const fs::path name = part.file.filename();
  if (name == "figures.json") return answer || whole.kind == ResultKind::law;
  return part.kind == ResultKind::law && name == "law.json" && answer;
}

}  // namespace

FolderResults results_in(const fs::path& folder) {
  std::vector<FoundResult> found;
  FolderResults results;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    try {
      const ResultKind kind = result_kind(entry.path());
      if (kind != ResultKind::none) found.push_back({kind, entry.path()});
    } catch (const Error& error) {
      if (error.code() != ExitCode::bad_input) throw;
      results.not_shown.push_back({entry.path(), error});
    }
  }
  std::ranges::sort(found, [](const FoundResult& a, const FoundResult& b) {
    return std::tie(a.kind, a.file) < std::tie(b.kind, b.file);
  });
  std::ranges::sort(results.not_shown, {}, &NotShown::file);
  for (const FoundResult& result : found) {
    const auto shows = [&](const FoundResult& whole) { return is_part_of(result, whole); };
    if (std::ranges::none_of(found, shows)) results.shown.push_back(result.file);
  }
  return results;
}

std::string Viewed::html() const {
  if (pages.size() == 1 && not_shown.empty()) return pages.front().html();
  return html_of(
      pages, mapped<std::string>(files, [](const fs::path& f) { return f.filename().string(); }),
      mapped<std::string>(not_shown, [](const NotShown& n) { return n.reason.what(); }));
}

Viewed view_path(const fs::path& path, const ViewOptions& options) {
  Viewed viewed;
  if (!fs::is_directory(path)) {
    viewed.files = {path};
    viewed.pages = {view_file(path, options)};
    return viewed;
  }
  FolderResults found = results_in(path);
  if (found.shown.empty() && found.not_shown.empty()) {
    throw bad_input(path.string(), "is a folder without a result that tpm view shows", kShownFiles);
  }
  if (found.shown.empty()) {
    const Error& first = found.not_shown.front().reason;
    if (found.not_shown.size() == 1) throw first;
    throw first.within(fmt::format("{}: {} files that tpm view does not show, the first",
                                   path.string(), found.not_shown.size()));
  }
  if (found.shown.size() > kMostResultsOfPage) {
    throw bad_input(path.string(), fmt::format("holds {} results", found.shown.size()),
                    fmt::format("{} at most on one page, or one of them", kMostResultsOfPage));
  }
  for (const fs::path& file : found.shown) viewed.pages.push_back(view_file(file, options));
  viewed.files = std::move(found.shown);
  viewed.not_shown = std::move(found.not_shown);
  return viewed;
}

ViewPage view_file(const fs::path& file, const ViewOptions& options) {
  const std::string bytes = read_file(file);
  switch (first_bytes(bytes)) {
    case FirstBytes::hdf5:
      return plan::view_simulation(file, bytes, options);
    case FirstBytes::rows:
      return view_recording(file, bytes, options);
    case FirstBytes::json:
      return fit::view_fit(file, bytes);
    case FirstBytes::other:
      break;
  }
  throw bad_input(file.string(), "is nothing that tpm view shows", kShownFiles);
}

}  // namespace tpm::haptics
