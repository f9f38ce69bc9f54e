#include "tpm/show/draw.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <vector>

#include "tpm/base/warning.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/show/run_record.hpp"
#include "tpmkit/error.hpp"

namespace tpm::show {
namespace {

/// Outcome of a program that was run.
struct Outcome {
  int status = 0;            ///< exit status; 127 if it could not be started
  std::string error_output;  ///< what it wrote to standard error
};

std::string read_to_end(int fd) {
  std::string text;
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t n = ::read(fd, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return 127;
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// The folders of a list such as $PATH, without its empty and relative parts, which would stand for
/// the current folder.
std::vector<std::string> absolute_parts(std::string_view list) {
  std::vector<std::string> kept;
  std::istringstream parts{std::string(list)};
  for (std::string part; std::getline(parts, part, ':');) {
    if (part.starts_with('/')) kept.push_back(part);
  }
  return kept;
}

/// The environment for a Python: lists of folders without empty and relative parts. Nothing that
/// lies where the user stands may be run, loaded or imported.
std::vector<std::string> safe_environment() {
  constexpr std::array<std::string_view, 3> kLists{"PATH=", "PYTHONPATH=", "LD_LIBRARY_PATH="};
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text(*variable);
    const auto list = std::find_if(kLists.begin(), kLists.end(),
                                   [&](std::string_view key) { return text.starts_with(key); });
    if (list == kLists.end()) {
      variables.emplace_back(text);
      continue;
    }
    const auto kept = absolute_parts(text.substr(list->size()));
    if (!kept.empty()) variables.push_back(fmt::format("{}{}", *list, fmt::join(kept, ":")));
  }
  // drawing_files.py marks drawings with it.
  if (const std::string origin = result_origin(); !origin.empty()) {
    variables.push_back(fmt::format("TPM_ORIGIN={}", origin));
  }
  return variables;
}

/// The file of a program: one with a slash is beside the caller, a bare name is searched for in the
/// absolute parts of $PATH. Empty if there is none.
std::string program_file(const std::string& program) {
  if (program.find('/') != std::string::npos) return std::filesystem::absolute(program).string();
  const char* path = std::getenv("PATH");
  for (const std::string& folder : absolute_parts(path == nullptr ? "/usr/bin:/bin" : path)) {
    const std::filesystem::path file = std::filesystem::path(folder) / program;
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file, ignored) && ::access(file.c_str(), X_OK) == 0) {
      return file.string();
    }
  }
  return {};
}

/// Pointers to the words, with a null at the end, as the system takes them.
std::vector<char*> pointers_to(const std::vector<std::string>& words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (const std::string& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

/// Runs a program (program_file()) from `/` and without a shell, its standard output discarded.
Outcome run(const std::vector<std::string>& words) {
  const std::string file = program_file(words.front());
  if (file.empty()) return {127, std::strerror(ENOENT)};
  const std::vector<std::string> variables = safe_environment();
  const std::vector<char*> arguments = pointers_to(words);
  const std::vector<char*> environment = pointers_to(variables);

  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw Error(ExitCode::environment, words.front(),
                fmt::format("no pipe to it: {}", std::strerror(errno)));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, "/");
  pid_t child = 0;
  const int failed =
      ::posix_spawn(&child, file.c_str(), &actions, nullptr, arguments.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  Outcome outcome;
  if (failed == 0) {
    outcome.error_output = read_to_end(ends[0]);
    outcome.status = wait_for(child);
  } else {
    outcome = {127, std::strerror(failed)};
  }
  ::close(ends[0]);
  return outcome;
}

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const auto start = text.rfind('\n');
  return start == std::string::npos ? text : text.substr(start + 1);
}

/// Runs a script of the project; throws if it fails. It starts in another folder: files are named
/// by absolute paths.
/// @param drawings that it writes
void run_script(const std::string& python, const char* name,
                const std::vector<std::string>& arguments,
                const std::vector<std::filesystem::path>& drawings) {
  for (const std::filesystem::path& drawing : drawings) require_not_read(drawing);
  const std::string script = std::filesystem::absolute(share_dir() / "scripts" / name).string();
  std::vector<std::string> words{python, script};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const Outcome outcome = run(words);
  for (const std::filesystem::path& drawing : drawings) note_written(drawing);
  if (outcome.status == 0) return;
  throw Error(ExitCode::environment, script,
              fmt::format("ended with status {}: {}", outcome.status,
                          printable(last_line(outcome.error_output), 200)));
}

/// With a line in place of each picture, for one that was not drawn.
Document without_pictures(Document document) {
  for (DocumentPart& part : document.blocks) {
    const auto* picture = std::get_if<Picture>(&part);
    if (picture == nullptr) continue;
    part = Paragraph{
        fmt::format("[{}: not drawn for want of a Python with matplotlib; its numbers are in "
                    "figures.json under {}] {}",
                    picture->title, picture->id, picture->caption)};
  }
  return document;
}

}  // namespace

std::string find_drawing_python() {
  std::vector<std::string> candidates{"python3", "/usr/bin/python3"};
  // Whoever names an interpreter wants that one or none.
  if (const char* chosen = std::getenv("TPMKIT_PYTHON"); chosen != nullptr && *chosen != '\0') {
    candidates = {chosen};
  }
  for (const std::string& python : candidates) {
    // With -c the current folder comes first in sys.path; sys itself is built in.
    constexpr const char* kImport =
        "import sys; sys.path[:] = [p for p in sys.path if p.startswith('/')]; import matplotlib";
    if (run({python, "-c", kImport}).status == 0) return python;
  }
  warn(
      fmt::format("figures are not drawn: no Python with matplotlib; tried {}; expected Debian's "
                  "python3-matplotlib, or TPMKIT_PYTHON naming an interpreter that has it",
                  fmt::join(candidates, ", ")));
  return {};
}

void draw_figures(const std::string& python, const std::filesystem::path& figures_json,
                  const std::filesystem::path& folder, Drawings drawings) {
  if (python.empty()) return;
  std::vector<std::string> words{std::filesystem::absolute(figures_json).string(),
                                 std::filesystem::absolute(folder).string()};
  words.emplace_back(drawings == Drawings::for_print ? "--print" : "--pdf");
  std::vector<std::filesystem::path> files;
  const Json figures = read_json(figures_json);
  for (const Json& figure : figures.at("figures")) {
    const auto id = figure.at("id").get<std::string>();
    files.push_back(folder / (id + ".svg"));
    files.push_back(folder / (id + ".pdf"));
    if (drawings == Drawings::for_print) files.push_back(folder / (id + ".png"));
  }
  run_script(python, "draw_figures.py", words, files);
}

void write_document(const std::filesystem::path& folder, const Document& document,
                    const std::vector<Figure>& figures, const std::string& python) {
  write_file(folder / "figures.json", to_text(to_json(figures)));
  draw_figures(python, folder / "figures.json", folder / "figures");
  std::map<std::string, std::string> drawings;
  for (const Figure& figure : figures) {
    if (python.empty()) break;
    drawings[figure.id] = read_file(folder / "figures" / (figure.id + ".svg"));
  }
  const Document written = python.empty() ? without_pictures(document) : document;
  write_file(folder / "report.md", to_markdown(written));
  write_file(folder / "report.html", to_html(written, drawings));
}

void write_report(const std::filesystem::path& folder, const Document& document,
                  const std::vector<Figure>& figures, const std::string& python,
                  std::map<std::string, double> seconds, const Json& more) {
  const auto start = std::chrono::steady_clock::now();
  write_document(folder, document, figures, python);
  seconds["drawing"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  Json record = run_record(seconds);
  record["drawing_python"] = python;
  record.update(more);
  write_file(folder / "report.run.json", to_text(record));
}

void draw_network(const std::string& python, const std::filesystem::path& picture_json,
                  const std::filesystem::path& stem) {
  if (python.empty()) return;
  run_script(
      python, "draw_network.py",
      {std::filesystem::absolute(picture_json).string(), std::filesystem::absolute(stem).string()},
      {stem.string() + ".svg", stem.string() + ".png", stem.string() + ".pdf"});
}

std::vector<std::string> draw_deformation(const std::string& python,
                                          const std::filesystem::path& pictures_json,
                                          const std::filesystem::path& folder, bool two) {
  if (python.empty()) return {};
  std::vector<std::string> files;
  for (const char* name :
       {"undeformed", "deformed", "displacement", "force", "validity", "side_by_side"}) {
    if (std::string_view(name) == "side_by_side" && !two) continue;
    files.push_back(fmt::format("{}.svg", name));
    files.push_back(fmt::format("{}.png", name));
    files.push_back(fmt::format("{}.pdf", name));
  }
  std::vector<std::filesystem::path> drawings;
  for (const std::string& file : files) drawings.push_back(folder / file);
  run_script(python, "draw_deformation.py",
             {std::filesystem::absolute(pictures_json).string(),
              std::filesystem::absolute(folder).string()},
             drawings);
  return files;
}

std::vector<std::string> write_figures(const std::filesystem::path& folder,
                                       const std::vector<Figure>& figures,
                                       std::vector<std::string> files) {
  const std::string& json = files.emplace_back("figures.json");
  write_file(folder / json, to_text(to_json(figures)));
  const std::string python = find_drawing_python();
  draw_figures(python, folder / json, folder, Drawings::for_print);
  if (python.empty()) return files;
  for (const Figure& figure : figures) {
    files.push_back(fmt::format("{}.svg", figure.id));
    files.push_back(fmt::format("{}.png", figure.id));
    files.push_back(fmt::format("{}.pdf", figure.id));
  }
  return files;
}

}  // namespace tpm::show
