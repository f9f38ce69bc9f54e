#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {

// Options of several commands: one declaration each.

/// Adds --verbose: all that was computed instead of an answer of at most 25 lines.
/// @param such_as "every law tried, starts, readings"
inline void add_verbose_option(CLI::App& command, bool& verbose, const char* such_as) {
  command.add_flag(
      "--verbose", verbose,
      fmt::format("Print everything: {} (default: an answer of at most 25 lines)", such_as));
}

/// Throws Error(usage) for a file of --output whose ending says that it is of another kind than
/// what is written. What begins with a digit is part of the name ("organ_0.5").
inline void require_ending(const std::string& output, const std::vector<std::string>& endings) {
  const std::string ending = std::filesystem::path(output).extension().string();
  const bool kind = ending.size() > 1 && std::isalpha(static_cast<unsigned char>(ending[1])) != 0;
  if (!kind || std::ranges::find(endings, ending) != endings.end()) return;
  throw Error(ExitCode::usage, "-o " + output,
              fmt::format("this command writes no file that ends in {}", printable(ending)),
              fmt::format("{}, or no ending", fmt::join(endings, ", ")));
}

/// Adds --folder.
/// @param of what is written, after the sentence that all commands share: ": figures (SVG, PNG)"
template <class Text>
CLI::Option* add_folder_option(CLI::App& command, Text& folder, const char* of = "") {
  return command.add_option("--folder", folder, fmt::format("Folder to write into{}", of));
}

/// Adds --seed.
/// @param of what is drawn, after the sentence that all commands share: ": the starts"
template <class Text>
CLI::Option* add_seed_option(CLI::App& command, Text& seed, const char* of) {
  return command.add_option("--seed", seed,
                            fmt::format("Seed of the random numbers, 0 or more{}", of));
}

/// Adds --draws.
/// @param of what the laws are drawn for: "the random part"
template <class Text>
CLI::Option* add_draws_option(CLI::App& command, Text& draws, const char* of) {
  return command.add_option(
      "--draws", draws,
      fmt::format("Number of laws drawn from the covariance, 100 or more: {}", of));
}

/// Adds the argument LAW|SCENE of a command that takes either.
inline CLI::Option* add_law_or_scene(CLI::App& command, std::string& file) {
  return command.add_option("LAW|SCENE", file,
                            "law.json that tpm fit has written, or the organ (scene.json or "
                            "material.json) on which tpm material has put it");
}

/// Adds the argument SESSION of a command that runs it.
inline void add_session_argument(CLI::App& command, std::string& file) {
  command.add_option("SESSION", file, "JSON session (schemas/hil.schema.json)")->required();
}

/// Adds the argument RECORDING of a command that reads a session's recording.
inline void add_session_recording(CLI::App& command, std::string& file) {
  command.add_option("RECORDING", file, "What tpm hil run has written")->required();
}

/// Adds the argument SCENE.
inline void add_scene_argument(CLI::App& command, std::string& file) {
  command.add_option("SCENE", file, "JSON scene (schemas/scene.schema.json)");
}

/// Adds the argument LAW of a command that takes what was fitted.
inline void add_fitted_law(CLI::App& command, std::string& file) {
  command.add_option("LAW", file, "law.json that tpm fit has written")->required();
}

}  // namespace tpm::app
