#pragma once
#include <string>
#include <string_view>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/files/import/recording_file.hpp"

namespace tpm::test {
using namespace files;

/// Reads a text as tpm fit reads a file.
class TableReader {
 public:
  RecordingFile operator()(const std::string& text, const ImportOptions& options = {}) const {
    write_file(folder_ / "table.txt", text);
    return read_recording_file(folder_ / "table.txt", options);
  }
  /// The message of the refusal; empty if there is none.
  std::string refusal(const std::string& text, const ImportOptions& options = {}) const {
    return refusal_of([&] { static_cast<void>((*this)(text, options)); });
  }

 private:
  TempFolder folder_;
};

/// Options of which one is set.
inline ImportOptions with(std::string_view key, const std::string& text) {
  ImportOptions options;
  set_reading_option(options, key, text, "test");
  return options;
}

}  // namespace tpm::test
