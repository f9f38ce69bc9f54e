#pragma once
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/files/keys/types.hpp"

namespace tpm::files {

/// The options of reading a file, as texts under one set of keys: the command line (--step-time),
/// the block `import` of a fit's configuration (step_time) and Python (step_time=...) all go
/// through here.
struct ReadingOption {
  std::string_view key;
  std::string_view meaning;       ///< one line, for the help
  std::string_view choices = "";  ///< the texts that it takes, with commas; empty: others
};

/// All of them, but the units, which are pairs.
[[nodiscard]] std::span<const ReadingOption> reading_options();

/// Sets one option from its text: `rest_length` from "20 mm", `decimal` from "comma", `segments`
/// from "extend,pause", `negate_drive` from "true". Throws Error(bad_input) for an unknown key or a
/// text that it does not take.
/// @param where place for the error message
void set_reading_option(ImportOptions& options, std::string_view key, const std::string& text,
                        std::string_view where);

/// Sets the unit of a column by its name or number. Throws Error(bad_input) for an unknown unit.
void set_reading_unit(ImportOptions& options, const std::string& column, const std::string& unit,
                      std::string_view where);

/// The options that say something, as texts that set_reading_option takes; without the units.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> reading_texts(
    const ImportOptions& options);

/// The options as an object in a file, with the key `units` for a map of columns.
[[nodiscard]] ValueType<ImportOptions> reading_type();

/// True if an option that concerns the content of a file says something.
[[nodiscard]] bool says_how_to_read(const ImportOptions& options);

}  // namespace tpm::files
