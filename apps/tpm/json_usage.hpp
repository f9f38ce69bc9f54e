#pragma once
#include <CLI/CLI.hpp>

#include "tpm/files/json.hpp"

namespace tpm::app {

/// Answer of `tpm --json-usage`: each command with its name, text, group, arguments, options and
/// commands below it; an option with its names, text, group, default, the values that it may have
/// where they are listed, and what it excludes. Completion of shells is made from it.
[[nodiscard]] files::Json json_usage(const CLI::App& app);

}  // namespace tpm::app
