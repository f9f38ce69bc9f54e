#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// A file that is being imported. It is taken apart as a table once an importer asks for that.
class ImportInput {
 public:
  /// @param options are kept as a reference
  ImportInput(std::string bytes, std::string file, const ImportOptions& options)
      : bytes_(std::move(bytes)), file_(std::move(file)), options_(options) {}

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] const std::string& file() const { return file_; }  ///< for messages
  [[nodiscard]] const ImportOptions& options() const { return options_; }
  /// Rows may differ in length; each importer checks its own. Throws Error(bad_input).
  [[nodiscard]] const DelimitedTable& table();
  [[nodiscard]] bool is_table() const { return table_.has_value(); }  ///< table() was called

 private:
  std::string bytes_;
  std::string file_;
  const ImportOptions& options_;
  std::optional<DelimitedTable> table_;
};

/// A kind of foreign file. The list in import.cpp holds all (docs/adding.md).
struct Importer {
  std::string_view name;  ///< as --input-format takes it
  Provenance usual;       ///< of such a file if the options give none
  /// True if the content can only be a file of this kind.
  bool (*recognizes)(ImportInput& input);
  std::vector<ImportedSeries> (*read)(ImportInput& input);
};

}  // namespace tpm::files
