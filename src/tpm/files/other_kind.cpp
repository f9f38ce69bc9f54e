#include "tpm/files/other_kind.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

/// A kind of file, what people call it, the command that reads it, and keys that no other kind has
/// together.
struct KindMarks {
  std::string_view kind, called, command;
  std::array<std::string_view, 2> keys;
};

/// The first that fits names a document: a session may have a scene within, not beside.
constexpr auto kKindMarks = std::to_array<KindMarks>({
    {"hil_recording",
     "the header of a session's recording",
     "tpm hil verify",
     {"format", "session"}},
    {"sweep", "a sweep", "tpm sweep", {"axes", "outputs"}},
    {"design", "a design of experiments", "tpm design", {"candidates", "noise"}},
    {"organ_experiments",
     "a study of experiments",
     "tpm paper experiments",
     {"tissues", "conditions"}},
    {"benchmark", "a benchmark", "tpm accuracy benchmark", {"problems", "timing"}},
    {"claims", "a list of claims", "tpm paper audit", {"claims", "symbols"}},
    {"fit_tables", "a fit in tables", "tpm fit", {"parameter_file", "measurement_file"}},
    {"fit", "the configuration of a fit", "tpm fit", {"parameters", "data"}},
    {"law", "a fitted law", "tpm predict", {"law", "response"}},
    {"curve", "the description of a curve", "tpm data", {"id", "kind"}},
    {"device", "the description of a device", "tpm hil run --device", {"device", "limits"}},
    {"law_on_organ",
     "a law put on an organ",
     "tpm predict, tpm validate or tpm simulate with the scene.json beside it",
     {"fitted_law", "scene"}},
    {"selection",
     "the answer of a fit",
     "the law.json that tpm fit wrote beside it",
     {"recommended", "laws"}},
    {"wpd", "a recording", "tpm fit", {"datasetColl", "wpd"}},
    {"scene", "a scene", "tpm simulate", {"organ", "organ"}},
    {"hil", "a session", "tpm hil run", {"indentations", "indentations"}},
    {"hil", "a session", "tpm hil run", {"slides", "slides"}},
    {"hil", "a session", "tpm hil run", {"motion", "motion"}},
    {"protocol", "a protocol", "tpm predict LAW with it", {"protocol", "protocol"}},
});

constexpr std::string_view kTable = "a table of samples";

struct FirstBytes {
  std::string_view bytes, called;
};
constexpr auto kOtherFiles = std::to_array<FirstBytes>({
    {"TPMROWS1", "the recording of a session (.tpmrec)"},
    {"\x89HDF", "an HDF5 file, such as a result of tpm simulate"},
    {"<!DOCTYPE html", "a web page"},
    {"<html", "a web page"},
    {"%PDF", "a PDF"},
    {"\x89PNG", "a picture"},
    {"PK", "an archive, such as a workbook (.xlsx)"},
});

/// True if a line is text in two fields or more.
bool has_fields(std::string_view line) {
  const auto printed = [](char c) { return c == '\t' || static_cast<unsigned char>(c) >= ' '; };
  return std::ranges::all_of(line, printed) && line.find_first_of(",;\t") != line.npos;
}

/// Other files have a block `protocol`, too.
bool is_protocol_alone(const Json& document) {
  constexpr auto kBeside =
      std::to_array<std::string_view>({"protocol", "outputs", "title", "description", "$schema"});
  return std::ranges::all_of(document.items(), [&](const auto& entry) {
    return std::ranges::find(kBeside, entry.key()) != kBeside.end();
  });
}

const KindMarks* marks_of(std::string_view kind) {
  const auto found = std::ranges::find(kKindMarks, kind, &KindMarks::kind);
  return found == kKindMarks.end() ? nullptr : &*found;
}

/// The command to use instead. A law is put on an organ, or felt, by a command of its own.
std::string command_instead(const KindMarks& found, std::string_view wanted,
                            std::string_view where) {
  if (found.kind != "law") return std::string(found.command);
  const std::string law = shell_word(std::string(where));
  if (wanted == "scene") {
    return fmt::format("tpm material {} SCENE --folder on_organ, which writes on_organ/scene.json",
                       law);
  }
  if (wanted == "hil") return fmt::format("tpm hil run SESSION --law {}", law);
  return std::string(found.command);
}

}  // namespace

void require_not_other_kind(const Json& document, std::string_view kind, std::string_view where) {
  if (!document.is_object()) return;
  const auto is_wanted = [kind](const KindMarks& marks) { return marks.kind == kind; };
  const auto is_marked = [&](const KindMarks& marks) {
    if (marks.kind == "protocol" && !is_protocol_alone(document)) return false;
    return document.contains(marks.keys[0]) && document.contains(marks.keys[1]);
  };
  const auto wanted = std::find_if(kKindMarks.begin(), kKindMarks.end(), is_wanted);
  const auto found = std::find_if(kKindMarks.begin(), kKindMarks.end(), is_marked);
  if (wanted == kKindMarks.end() || found == kKindMarks.end()) return;
  // The configuration of a fit and an organ's material have a key `law`, too.
  const auto own = [&](std::string_view key) { return key != "law" && document.contains(key); };
  for (const KindMarks& marks : kKindMarks) {
    // One key of its own is enough: the other may be misspelt.
    if (is_wanted(marks) && (own(marks.keys[0]) || own(marks.keys[1]))) return;
  }
  throw bad_input(
      where, fmt::format("this is {}; use {}", found->called, command_instead(*found, kind, where)),
      fmt::format("{}, for {}", wanted->called, wanted->command));
}

std::optional<std::string_view> kind_without_json(std::string_view bytes) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
  for (const FirstBytes& first : kOtherFiles) {
    if (bytes.starts_with(first.bytes)) return first.called;
  }
  const std::size_t begin = bytes.find_first_not_of(" \t\r\n");
  if (begin == bytes.npos || bytes[begin] == '{' || bytes[begin] == '[') return std::nullopt;
  constexpr std::size_t kLines = 5;  // a title may stand above the columns
  std::string_view rest = bytes.substr(begin);
  for (std::size_t i = 0; i < kLines && !rest.empty(); ++i) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (end < rest.size() && has_fields(line)) return kTable;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return std::nullopt;
}

Json read_json_of(const std::filesystem::path& path, std::string_view kind) {
  const KindMarks* wanted = marks_of(kind);
  if (wanted == nullptr) return read_json(path);
  const bool law = kind == "law";
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    const std::filesystem::path within = path / fmt::format("{}.json", kind);
    const std::string expected =
        std::filesystem::exists(within, ignored)
            ? fmt::format("the file in it: {}", within.string())
            : fmt::format("{}: a file, for {}", wanted->called, wanted->command);
    throw bad_input(path.string(), "is a folder", expected);
  }
  const std::string text = read_file(path);
  const auto called = kind_without_json(text);
  if (!called) return parse_json(text, path.string());
  throw bad_input(
      path.string(), fmt::format("this is {}", *called),
      law && *called == kTable
          ? fmt::format("a fitted law; a recording is fitted first: tpm fit {} --folder "
                        "fitted writes fitted/law.json",
                        shell_word(path.string()))
          : fmt::format("{}, for {}", wanted->called, wanted->command));
}

}  // namespace tpm::files
