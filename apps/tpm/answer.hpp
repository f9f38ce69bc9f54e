#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "command.hpp"
#include "tpmkit/law.hpp"

namespace tpm::app {

/// Yes-or-no answer of a command, as its exit code 0 or 1 tells it.
struct Verdict {
  std::string_view code;  ///< "network_stands"
  bool holds = false;
};

/// The answer of a command as JSON. What all answers have stands before the members of `result`
/// (docs/json.md): `tpm`, `command`, `version`, `inputs` with SHA-256, `verdicts` and `remarks`. To
/// be called when all inputs were read.
/// @param result an object; a member `version` is the program's, `remarks` is made by
///               remarks_json(); no other member has a name of the envelope
[[nodiscard]] std::string answer_text(const Session& session, Json result,
                                      const std::vector<Verdict>& verdicts = {});

/// Adds to a result what ends its text (end_answer()): `files`, those that were written, and
/// `next`, the command to type next; null if there is none.
/// @param folder the files are in; may be empty
void add_end(Json& result, const std::filesystem::path& folder,
             const std::vector<std::string>& files, const std::string& next);

/// The command that puts a law to use: a session of an indentation law, else the law in another
/// program.
/// @param law path of the law's file
[[nodiscard]] std::string next_with_law(const std::string& law, const LawSpec& spec);

/// The command that shows the figures that were drawn into a folder.
[[nodiscard]] std::string next_of_pictures(const std::filesystem::path& folder);

/// "next: COMMAND", the line that ends a text; none if there is no command.
[[nodiscard]] std::string next_line(const std::string& next);

/// The command line that was given, to be typed again with more options or without a flag; its
/// answer goes to the terminal as text, so --format and --output are left out.
/// @param more    "--folder budget", as a shell takes it
/// @param without "--estimate"; may be empty
[[nodiscard]] std::string same_command(const Session& session, std::string_view more,
                                       std::string_view without = {});

}  // namespace tpm::app
