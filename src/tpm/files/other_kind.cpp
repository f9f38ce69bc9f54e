#include "tpm/files/other_kind.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tpm/base/namespaces.hpp"
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
    {"scene", "a scene", "tpm simulate", {"organ", "organ"}},
    {"hil", "a session", "tpm hil run", {"indentations", "indentations"}},
    {"hil", "a session", "tpm hil run", {"slides", "slides"}},
    {"hil", "a session", "tpm hil run", {"motion", "motion"}},
});

}  // namespace

void require_not_other_kind(const Json& document, std::string_view kind, std::string_view where) {
  if (!document.is_object()) return;
  const auto is_wanted = [kind](const KindMarks& marks) { return marks.kind == kind; };
  const auto is_marked = [&](const KindMarks& marks) {
    return document.contains(marks.keys[0]) && document.contains(marks.keys[1]);
  };
  const auto wanted = std::find_if(kKindMarks.begin(), kKindMarks.end(), is_wanted);
  const auto found = std::find_if(kKindMarks.begin(), kKindMarks.end(), is_marked);
  if (wanted == kKindMarks.end() || found == kKindMarks.end()) return;
  for (const KindMarks& marks : kKindMarks) {
    // One key of its own is enough: the other may be misspelt.
    const bool own = document.contains(marks.keys[0]) || document.contains(marks.keys[1]);
    if (is_wanted(marks) && own) return;
  }
  throw bad_input(where, fmt::format("this is {}; use {}", found->called, found->command),
                  fmt::format("{}, for {}", wanted->called, wanted->command));
}

}  // namespace tpm::files
