#include "tpm/show/draw.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string_view>
#include <vector>

#include "tpm/files/file.hpp"
#include "tpm/show/run_record.hpp"
#include "tpmkit/error.hpp"

namespace tpm::show {
namespace {

/// What became of a program that was run.
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

/// The environment for a Python: PYTHONPATH without empty and relative parts, which would stand for
/// the current folder. Nothing that lies where the user stands may be imported.
std::vector<std::string> safe_environment() {
  constexpr std::string_view kKey = "PYTHONPATH=";
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text(*variable);
    if (!text.starts_with(kKey)) {
      variables.emplace_back(text);
      continue;
    }
    std::string kept;
    std::istringstream parts{std::string(text.substr(kKey.size()))};
    for (std::string part; std::getline(parts, part, ':');) {
      if (part.starts_with('/')) kept += (kept.empty() ? "" : ":") + part;
    }
    if (!kept.empty()) variables.push_back(std::string(kKey) + kept);
  }
  return variables;
}

/// Pointers to the words, with a null at the end, as the system takes them.
std::vector<char*> pointers_to(const std::vector<std::string>& words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (const std::string& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

/// Runs a program (searched for on the path) without a shell, its standard output discarded.
Outcome run(const std::vector<std::string>& words) {
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
  pid_t child = 0;
  const int failed =
      ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environment.data());
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

/// Runs a script of the project; throws if it fails.
void run_script(const std::string& python, const char* name,
                const std::vector<std::string>& arguments) {
  const std::string script = (share_dir() / "scripts" / name).string();
  std::vector<std::string> words{python, script};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const Outcome outcome = run(words);
  if (outcome.status == 0) return;
  throw Error(ExitCode::environment, script,
              fmt::format("ended with status {}: {}", outcome.status,
                          printable(last_line(outcome.error_output), 200)));
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
  throw Error(ExitCode::environment, "figures",
              fmt::format("no Python with matplotlib; tried {}", fmt::join(candidates, ", ")),
              "Debian's python3-matplotlib, or TPMKIT_PYTHON naming an interpreter that has it");
}

void draw_figures(const std::string& python, const std::filesystem::path& figures_json,
                  const std::filesystem::path& folder, Drawings drawings) {
  std::vector<std::string> words{figures_json.string(), folder.string()};
  if (drawings == Drawings::svg_and_png) words.emplace_back("--png");
  run_script(python, "draw_figures.py", words);
}

std::map<std::string, std::string> draw_into(const std::filesystem::path& folder,
                                             const std::vector<Figure>& figures,
                                             const std::string& python) {
  write_file(folder / "figures.json", to_text(to_json(figures)));
  draw_figures(python, folder / "figures.json", folder / "figures");
  std::map<std::string, std::string> drawings;
  for (const Figure& figure : figures) {
    drawings[figure.id] = read_file(folder / "figures" / (figure.id + ".svg"));
  }
  return drawings;
}

void write_report(const std::filesystem::path& folder, const Document& document,
                  const std::vector<Figure>& figures, const std::string& python,
                  std::map<std::string, double> seconds, const Json& more) {
  const auto drawings =
      timed(seconds, "drawing", [&] { return draw_into(folder, figures, python); });
  write_file(folder / "report.md", to_markdown(document));
  write_file(folder / "report.html", to_html(document, drawings));
  Json record = run_record(seconds);
  record["drawing_python"] = python;
  record.update(more);
  write_file(folder / "report.run.json", to_text(record));
}

void draw_network(const std::string& python, const std::filesystem::path& picture_json,
                  const std::filesystem::path& stem) {
  run_script(python, "draw_network.py", {picture_json.string(), stem.string()});
}

std::vector<std::string> draw_deformation(const std::string& python,
                                          const std::filesystem::path& pictures_json,
                                          const std::filesystem::path& folder, bool two) {
  run_script(python, "draw_deformation.py", {pictures_json.string(), folder.string()});
  std::vector<std::string> files;
  for (const char* name :
       {"undeformed", "deformed", "displacement", "force", "validity", "side_by_side"}) {
    if (std::string_view(name) == "side_by_side" && !two) continue;
    files.push_back(fmt::format("{}.svg", name));
    files.push_back(fmt::format("{}.png", name));
  }
  return files;
}

std::vector<std::string> write_figures(const std::filesystem::path& folder,
                                       const std::vector<Figure>& figures,
                                       std::vector<std::string> files) {
  const std::string& json = files.emplace_back("figures.json");
  write_file(folder / json, to_text(to_json(figures)));
  draw_figures(find_drawing_python(), folder / json, folder, Drawings::svg_and_png);
  for (const Figure& figure : figures) {
    files.push_back(fmt::format("{}.svg", figure.id));
    files.push_back(fmt::format("{}.png", figure.id));
  }
  return files;
}

}  // namespace tpm::show
