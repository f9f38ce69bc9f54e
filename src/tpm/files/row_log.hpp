#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/descriptor.hpp"
#include "tpm/files/replacement.hpp"

namespace tpm::files {

/// Appends rows of one size to a file, each with its number and a check sum, so that what was
/// written stands even if the process is killed. After the rows a closing text says that the
/// file is whole. Bytes are those of the machine that writes (little endian is asked for).
/// An unfinished file is meant to be found: it has its name as soon as its header is written, or,
/// `later`, from appear() on; one that never appeared leaves nothing behind.
class RowLogWriter {
 public:
  /// Throws Error(environment) if the file cannot be written.
  enum class Name { instantaneous, later };
  RowLogWriter(std::filesystem::path path, std::string_view header, std::size_t row_bytes,
               Name name = Name::instantaneous);

  /// Takes the place of a file of this name.
  void appear();
  /// Keeps the row; passes all kept ones to the system once they fill a block.
  void append(const void* row);
  /// Passes everything to the system: from here on it survives the process.
  void flush();
  void close(std::string_view closing);

 private:
  std::filesystem::path path_;
  std::unique_ptr<Replacement> begun_;  ///< until it appears
  Descriptor file_;
  std::size_t row_bytes_;
  std::uint32_t rows_ = 0;
  std::vector<std::byte> kept_;
};

/// Content of a file of rows.
struct RowLog {
  std::string header;
  std::size_t row_bytes = 0;
  std::size_t rows = 0;
  std::vector<std::byte> bytes;  ///< the rows, one after the other
  bool closed = false;           ///< the writer came to its end
  std::string closing;           ///< empty unless closed
  std::size_t damaged = 0;       ///< rows, or the closing text, that are there and are not whole
};

/// Reads all rows that are whole, and the closing text. Rows have one length, so that a damaged one
/// is left out and counted and what stands behind it is read.
/// Throws Error(bad_input) if the beginning is no such file.
[[nodiscard]] RowLog read_row_log(const std::filesystem::path& path);

}  // namespace tpm::files
