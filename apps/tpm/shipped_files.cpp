#include "shipped_files.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

/// Options, besides arguments without a name, whose value is a file that the command reads.
constexpr std::array<std::string_view, 12> kReading{"--scene",        "--session",
                                                    "--law",          "--budget-file",
                                                    "--costs",        "--configuration",
                                                    "--device-file",  "--instrument",
                                                    "--finer",        "--calibration-instrument",
                                                    "--at-recording", "--replay-motion"};

bool reads_a_file(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return false;  // a flag
  if (option.get_positional()) return true;
  return std::any_of(kReading.begin(), kReading.end(),
                     [&](std::string_view name) { return option.check_name(std::string(name)); });
}

/// The shipped file that a word stands for; empty if it is the user's own, or none.
fs::path shipped(const std::string& word) {
  if (!word.starts_with("configs/") && !word.starts_with("data/")) return {};
  std::error_code ec;
  if (fs::exists(fs::symlink_status(word, ec))) return {};
  const fs::path inside = fs::path(word).lexically_normal();
  if (!inside.string().starts_with("configs/") && !inside.string().starts_with("data/")) return {};
  fs::path file = files::share_dir() / inside;
  return fs::exists(file, ec) ? file : fs::path();
}

}  // namespace

void accept_shipped_files(CLI::App& app, std::vector<ShippedFile>& used) {
  for (CLI::App* command : app.get_subcommands({})) accept_shipped_files(*command, used);
  for (CLI::Option* option : app.get_options()) {
    if (!reads_a_file(*option)) continue;
    option->transform([&used](std::string word) {
      const fs::path file = shipped(word);
      if (file.empty()) return word;
      used.push_back({std::move(word), file.string()});
      return file.string();
    });
  }
}

}  // namespace tpm::app
