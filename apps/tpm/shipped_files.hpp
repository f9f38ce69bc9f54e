#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tpm::app {

/// A word of the command line that stands for a file which comes with tpm.
struct ShippedFile {
  std::string word;  ///< as given: "configs/liver_poke.json"
  std::string path;  ///< of the file in share_dir()
};

/// Lets the files that commands read be named as the pages name them, wherever the user stands: a
/// word below configs/ or data/ that leads to nothing from the working folder is replaced by the
/// file of that name in share_dir(). A file of the user's own is always taken first. Options that
/// name what is written are left alone.
/// @param used filled while the command line is read; has to outlive `app`
void accept_shipped_files(CLI::App& app, std::vector<ShippedFile>& used);

}  // namespace tpm::app
