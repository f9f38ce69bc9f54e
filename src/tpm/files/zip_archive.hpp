#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::files {

/// True for bytes that begin like a ZIP archive with at least one member.
[[nodiscard]] bool looks_like_zip(std::string_view bytes) noexcept;

/// Reads the members of a ZIP archive that is held in memory. Nothing is unpacked onto the disk, so
/// the names of members are names and never paths.
class ZipArchive {
 public:
  /// @param bytes the archive, which must outlive this object
  /// @param file  its name, for errors
  /// Throws Error(bad_input) if the directory of the archive is damaged or holds a name twice.
  ZipArchive(std::string_view bytes, std::string file);

  /// In alphabetical order, without folders.
  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] bool has(std::string_view name) const;

  /// The unpacked bytes of a member. Throws Error(bad_input) if there is no such member, if it is
  /// encrypted, packed by another method than `deflate`, damaged, or larger than `most` bytes: the
  /// size is checked before anything is unpacked.
  [[nodiscard]] std::string read(std::string_view name, std::uint64_t most) const;

  [[nodiscard]] const std::string& file() const noexcept { return file_; }

 private:
  struct Member {
    std::string name;
    std::uint64_t place = 0;  ///< of its entry in the directory
    std::uint64_t number = 0;
  };
  [[nodiscard]] const Member* find(std::string_view name) const;

  std::string_view bytes_;
  std::string file_;
  std::vector<Member> members_;  ///< by name
};

}  // namespace tpm::files
