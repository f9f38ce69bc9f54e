#include "answer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "tpm/base/text.hpp"
#include "tpm/files/files_read.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::app {
namespace {

namespace fs = std::filesystem;

/// Of the members that all answers have. Raised when one of them changes its meaning.
constexpr int kShape = 1;

/// The member `remarks` of a result, which may have none.
Json remarks_of(const Json& result) {
  const Json remarks = result.value("remarks", Json::array());
  const auto is_remark = [](const Json& one) {
    return one.is_object() && one.size() == 2 && one.contains("code") && one.contains("text");
  };
  if (!remarks.is_array() || !std::ranges::all_of(remarks, is_remark)) {
    throw std::logic_error("the remarks of a result are no list of {code, text}");
  }
  return remarks;
}

/// Files of the working folder have the name that they have in it.
std::string input_name(const fs::path& file) {
  std::error_code no_folder;
  const fs::path near = file.lexically_proximate(fs::current_path(no_folder));
  return no_folder || near.empty() || *near.begin() == ".." ? file.string() : near.string();
}

Json inputs() {
  return array_json(files::files_read(), [](const fs::path& file) {
    const std::string digest = files::sha256_of_file(file);
    std::error_code gone;
    if (digest.empty() && fs::is_regular_file(file, gone)) {  // a pipe has none
      throw Error(ExitCode::environment, file.string(), "cannot be read again for its SHA-256",
                  "a file that can be read");
    }
    return Json{{"file", input_name(file)},
                {"sha256", digest.empty() ? Json(nullptr) : Json(digest)}};
  });
}

}  // namespace

std::string answer_text(const Session& session, Json result, const std::vector<Verdict>& verdicts) {
  Json answer{{"tpm", kShape}, {"command", session.command}, {"version", version()}};
  answer["inputs"] = inputs();
  answer["verdicts"] = array_json(verdicts, [](const Verdict& verdict) {
    return Json{{"code", verdict.code}, {"holds", verdict.holds}};
  });
  answer["remarks"] = remarks_of(result);
  for (auto& [name, value] : result.items()) {
    if (name == "version" || name == "remarks") continue;
    if (answer.contains(name)) {
      throw std::logic_error(fmt::format("the result has a member '{}' of the envelope", name));
    }
    answer[name] = std::move(value);
  }
  return to_text(answer);
}

void add_end(Json& result, const fs::path& folder, const std::vector<std::string>& files,
             const std::string& next) {
  result["files"] =
      array_json(files, [&](const std::string& name) { return (folder / name).string(); });
  result["next"] = next.empty() ? Json(nullptr) : Json(next);
}

std::string next_with_law(const std::string& law, const LawSpec& spec) {
  const std::string file = shell_word(law);
  if (!is_answered_by_stress(spec.drive)) {
    return fmt::format("tpm hil run configs/hil_law.json --law {} -o session.tpmrec", file);
  }
  const bool sayable = spec.solid && spec.kernel != Kernel::power && spec.tension == Tension::none;
  return fmt::format("tpm export {} --to {}", file, sayable ? "febio" : "json --relaxation-only");
}

std::string next_of_pictures(const fs::path& folder) {
  return "tpm view " + shell_word((folder / "figures.json").string());
}

std::string next_line(const std::string& next) {
  return next.empty() ? std::string() : fmt::format("next: {}\n", next);
}

std::string same_command(const Session& session, std::string_view more, std::string_view without) {
  constexpr std::array<std::string_view, 3> kOfAnswer{"--format", "--output", "-o"};
  std::string command = "tpm";
  const auto names = std::ranges::find(session.words, "--");  // from there on all are names
  for (auto word = session.words.begin(); word != names; ++word) {
    if (std::ranges::find(kOfAnswer, *word) != kOfAnswer.end()) {
      if (++word == names) break;  // its value
      continue;
    }
    const bool of_answer = word->starts_with("--format=") || word->starts_with("--output=") ||
                           (word->starts_with("-o") && word->size() > 2);
    if (!of_answer && (without.empty() || *word != without)) command += " " + shell_quoted(*word);
  }
  if (!more.empty()) command += fmt::format(" {}", more);
  for (auto word = names; word != session.words.end(); ++word) command += " " + shell_quoted(*word);
  return command;
}

}  // namespace tpm::app
