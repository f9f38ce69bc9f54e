#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/descriptor.hpp"
#include "tpm/sweep/cell_block.hpp"

namespace tpm::sweep {

/// A block as a log holds it, check sums included: made where the block was computed, so that who
/// writes the log has nothing left to do but that.
[[nodiscard]] std::string log_record(const CellBlock& block);

/// Blocks of a sweep in the order in which they were finished, each with a check sum. What stands
/// in the file survives the process; a block that was cut short or damaged is not there.
class BlockLog {
 public:
  /// Opens the log for reading and going on, or begins it. Only one process can hold it.
  /// @param note told, in words, what was found damaged
  /// Throws Error(bad_input) for a file that is no log or that of another sweep,
  /// Error(environment) if it cannot be written or is held.
  BlockLog(std::filesystem::path path, const Sweep& sweep,
           const std::function<void(const std::string&)>& note);
  /// Opens a log for reading alone.
  [[nodiscard]] static BlockLog to_read(std::filesystem::path path, const Sweep& sweep,
                                        const std::function<void(const std::string&)>& note);

  [[nodiscard]] bool has(std::uint64_t block) const { return place_[block] != 0; }
  /// Number of blocks.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Throws Error(environment); the log is then as it was before.
  /// @param record of this block, from log_record()
  void append(std::uint64_t block, std::string_view record);
  /// Throws Error(environment) if so many blocks can never fit on the disk; room that is only
  /// missing now may be made while the sweep runs.
  void require_room(std::uint64_t blocks) const;
  /// Throws Error(bad_input) if the block was damaged since the log was opened.
  [[nodiscard]] CellBlock read(std::uint64_t block) const;
  /// Passes everything to the disk: from here on it survives the machine.
  void sync();

 private:
  BlockLog(std::filesystem::path path, const Sweep& sweep);
  void open(int flags);
  void begin();
  void find_blocks(const std::function<void(const std::string&)>& note);
  [[nodiscard]] std::uint64_t find_next(std::uint64_t from) const;
  [[nodiscard]] bool read_at(std::uint64_t offset, std::string& bytes, std::uint64_t size) const;
  /// The payload of a block if one begins here, and where it ends.
  [[nodiscard]] bool record_at(std::uint64_t offset, std::uint64_t& number, std::string& payload,
                               std::uint64_t& end) const;

  std::filesystem::path path_;
  const Sweep* sweep_;
  Descriptor file_;
  std::uint64_t length_ = 0;  ///< of the file
  std::uint64_t size_ = 0;
  std::vector<std::uint64_t> place_;  ///< of each block in the file; 0: it is not there
};

}  // namespace tpm::sweep
