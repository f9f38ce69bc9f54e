#include "tpm/haptics/show/view_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <tuple>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpm/fit/show/view_fit.hpp"
#include "tpm/haptics/show/view_recording.hpp"
#include "tpm/plan/show/view_simulation.hpp"

namespace tpm::haptics {
namespace fs = std::filesystem;
namespace {

constexpr const char* kShownFiles =
    "a result of tpm simulate (HDF5), a recording of tpm hil run, law.json, figures.json, "
    "validation.json or the JSON answer of tpm fit";

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
/// one of them may be the page that is written. Throws Error(bad_input) if it cannot be read.
std::string beginning_of(const fs::path& file) {
  constexpr std::size_t kLooked = 512;
  std::string bytes(kLooked, '\0');
  std::ifstream in(file, std::ios::binary);
  if (!in) throw bad_input(file.string(), "cannot be read", "a file that you may read");
  in.read(bytes.data(), kLooked);
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

/// True of bytes that may be a recording: a table, whatever its columns are.
bool is_table(std::string_view bytes) {
  const auto called = kind_without_json(bytes);
  return called && *called == "a table of samples";
}

/// @param path a table, or a folder of several
Error no_result(const fs::path& path, std::size_t tables) {
  const bool one = tables == 1;
  return bad_input(path.string(),
                   one ? "is a table, no result of tpm"
                       : fmt::format("holds {} tables, no result of tpm", tables),
                   fmt::format("tpm fit {}, if {}", shell_word(path.string()),
                               one ? "it is a recording" : "they are recordings"));
}

/// The order on the page.
enum class ResultKind { answer, law, validation, figures, simulation, recording, none };

/// Throws Error(bad_input) for what tpm view does not show.
ResultKind result_kind(const fs::path& file) {
  const std::string beginning = beginning_of(file);
  switch (first_bytes(beginning)) {
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
        case fit::FitFile::validation:
          return ResultKind::validation;
        case fit::FitFile::figures:
          return ResultKind::figures;
        case fit::FitFile::none:
          break;
      }
      break;
    case FirstBytes::other:
      if (beginning.find("<title>Credibility of ") != std::string::npos) {
        throw bad_input(file.string(), "is the credibility page of a validation",
                        "a browser; tpm validate --recheck computes it again");
      }
      break;
  }
  return ResultKind::none;
}

struct FoundResult {
  ResultKind kind{};
  fs::path file;
};

/// True of what stands on the page of another result of its folder: figures.json on that of a law,
/// an answer or a validation, law.json on that of the answer that tpm fit wrote beside it.
bool is_part_of(const FoundResult& part, const FoundResult& whole) {
  if (part.file.parent_path() != whole.file.parent_path()) return false;
  const bool answer = whole.kind == ResultKind::answer && fit::is_answer_of_folder(whole.file);
  const fs::path name = part.file.filename();
  if (name == "figures.json") {
    return answer || whole.kind == ResultKind::law ||
           (whole.kind == ResultKind::validation && fit::is_validation_of_folder(whole.file));
  }
  return part.kind == ResultKind::law && name == "law.json" && answer;
}

/// Adds its files, and those of the folders in it: of a specimen, a day, a fit. What cannot be
/// read, and links to folders, which may lead in a circle, are told.
void add_files_below(const fs::path& folder, int depth, std::vector<fs::path>& files,
                     std::vector<NotShown>& not_shown) {
  std::error_code error;
  const auto tell = [&](const fs::path& path, const char* what, std::string expected) {
    not_shown.push_back({path, bad_input(path.string(), what, expected)});
  };
  std::vector<fs::path> inside;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    inside.push_back(entry->path());
  }
  if (error) tell(folder, "cannot be read", "a folder that you may read");
  std::ranges::sort(inside);
  for (const fs::path& path : inside) {
    std::error_code ignored;  // a link that leads nowhere is no file
    if (fs::is_regular_file(path, ignored)) {
      files.push_back(path);
    } else if (fs::is_directory(path, ignored) && !path.filename().string().starts_with('.')) {
      if (fs::is_symlink(path, ignored)) {
        tell(path, "is a link to a folder, which is not followed",
             "tpm view " + shell_word(path.string()));
      } else if (depth < kFoldersBelow) {
        add_files_below(path, depth + 1, files, not_shown);
      }
    }
  }
}

/// True of a table that a result was written with: any beside JSON of tpm, the one that is called
/// like its HDF5.
bool is_table_of(const fs::path& table, const FoundResult& result) {
  if (table.parent_path() != result.file.parent_path()) return false;
  return result.file.extension() == ".json" || table.stem() == result.file.stem();
}

/// Tables that may be recordings: by their folder if it has several.
std::vector<NotShown> not_shown_tables(std::vector<fs::path> tables) {
  std::ranges::stable_sort(tables, {}, &fs::path::parent_path);
  std::vector<NotShown> list;
  for (std::size_t begin = 0, end = 0; begin < tables.size(); begin = end) {
    const fs::path folder = tables[begin].parent_path();
    end = begin;
    while (end < tables.size() && tables[end].parent_path() == folder) ++end;
    const std::size_t count = end - begin;
    const fs::path& named = count == 1 ? tables[begin] : folder;
    list.push_back({named, no_result(named, count)});
  }
  return list;
}

/// The folder of a fit is its name; other results are named with their folders.
std::vector<std::string> names_within(const fs::path& folder, const std::vector<fs::path>& files) {
  return mapped<std::string>(files, [&](const fs::path& file) {
    const fs::path parent = file.parent_path();
    const auto beside = [&](const fs::path& other) { return other.parent_path() == parent; };
    const bool alone = file.extension() == ".json" && std::ranges::count_if(files, beside) == 1;
    const fs::path name = file.lexically_relative(folder);
    return (alone && name.has_parent_path() ? name.parent_path() : name).generic_string();
  });
}

}  // namespace

FolderResults results_in(const fs::path& folder) {
  std::vector<FoundResult> found;
  std::vector<fs::path> tables;
  FolderResults results;
  std::vector<fs::path> files;
  add_files_below(folder, 0, files, results.not_shown);
  for (const fs::path& file : files) {
    bool notes = false;
    try {
      const bool json = first_bytes(beginning_of(file)) == FirstBytes::json;
      notes = json && file.extension() != ".json";  // they may begin like JSON
      const ResultKind kind = result_kind(file);
      const bool table = file.extension() == ".csv" || file.extension() == ".tsv";
      if (kind != ResultKind::none) {
        found.push_back({kind, file});
      } else if (table && is_table(beginning_of(file))) {
        tables.push_back(file);
      }
    } catch (const Error& error) {
      if (error.code() != ExitCode::bad_input) throw;
      if (!notes) results.not_shown.push_back({file, error});
    }
  }
  std::ranges::sort(found, [](const FoundResult& a, const FoundResult& b) {
    return std::tie(a.kind, a.file) < std::tie(b.kind, b.file);
  });
  std::erase_if(tables, [&](const fs::path& table) {
    const auto of = [&](const FoundResult& result) { return is_table_of(table, result); };
    const auto beside = [&](const NotShown& other) {
      return is_table_of(table, {ResultKind::none, other.file});
    };
    return std::ranges::any_of(found, of) || std::ranges::any_of(results.not_shown, beside);
  });
  for (const FoundResult& result : found) {
    const auto shows = [&](const FoundResult& whole) { return is_part_of(result, whole); };
    if (std::ranges::none_of(found, shows)) results.shown.push_back(result.file);
  }
  for (NotShown& other : not_shown_tables(tables)) results.not_shown.push_back(std::move(other));
  return results;
}

std::string Viewed::html() const {
  if (pages.size() == 1 && not_shown.empty()) return pages.front().html();
  return html_of(pages, names,
                 mapped<std::string>(not_shown, [](const NotShown& n) { return n.reason.what(); }));
}

Viewed view_path(const fs::path& path, const ViewOptions& options) {
  Viewed viewed;
  if (!fs::is_directory(path)) {
    viewed.files = {path};
    viewed.names = {path.filename().string()};
    viewed.pages = {view_file(path, options)};
    return viewed;
  }
  FolderResults found = results_in(path);
  if (found.shown.empty() && found.not_shown.empty()) {
    throw bad_input(path.string(), "is a folder without a result that tpm view shows", kShownFiles);
  }
  if (found.shown.size() > kMostResultsOfPage) {
    throw bad_input(path.string(), fmt::format("holds {} results", found.shown.size()),
                    fmt::format("{} at most on one page, or one of them", kMostResultsOfPage));
  }
  viewed.not_shown = std::move(found.not_shown);
  for (const fs::path& file : found.shown) {
    try {
      viewed.pages.push_back(view_file(file, options));
      viewed.files.push_back(file);
    } catch (const Error& error) {  // one damaged file does not hide the others
      if (error.code() != ExitCode::bad_input) throw;
      viewed.not_shown.push_back({file, error});
    }
  }
  if (viewed.pages.empty()) {
    const Error& first = viewed.not_shown.front().reason;
    if (viewed.not_shown.size() == 1) throw first;
    throw first.within(fmt::format("{}: {} files that tpm view does not show, the first",
                                   path.string(), viewed.not_shown.size()));
  }
  viewed.names = names_within(path, viewed.files);
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
      if (is_table(bytes)) throw no_result(file, 1);
      break;
  }
  throw bad_input(file.string(), "is nothing that tpm view shows", kShownFiles);
}

}  // namespace tpm::haptics
