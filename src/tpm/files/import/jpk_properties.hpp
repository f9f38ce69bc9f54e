#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::files {

using PropertyMap = std::map<std::string, std::string, std::less<>>;

/// Reads a Java properties file: lines of `key=value`, comments that begin with '#' or '!', lines
/// continued with a backslash at their end, and characters escaped with one.
[[nodiscard]] PropertyMap parse_properties(std::string_view text);

/// The properties of one segment of a JPK force file. Since format version 0.12 they may refer to
/// blocks that the segments share: `channel.height.lcd-info.*=3` in the segment's own file means
/// that `lcd-info.3.REST` of shared-data/header.properties is `channel.height.REST`.
class JpkProperties {
 public:
  /// @param shared properties of shared-data/header.properties; must outlive this object
  /// @param place  for errors: the file and the member that holds `own`
  JpkProperties(PropertyMap own, const PropertyMap& shared, std::string place);

  [[nodiscard]] std::optional<std::string> find(std::string_view key) const;

  /// The first of several keys that exists: format versions name some things differently.
  [[nodiscard]] std::optional<std::string> find_any(std::initializer_list<std::string> keys) const;

  /// Throws Error(bad_input) naming the key if it is missing.
  [[nodiscard]] std::string text(std::string_view key) const;

  /// Throws Error(bad_input) naming the key if it is missing or no finite number.
  [[nodiscard]] double number(std::string_view key) const;

  /// "FILE: MEMBER: key KEY", for errors.
  [[nodiscard]] std::string place_of(std::string_view key) const;

 private:
  struct Reference {
    std::string head;   ///< "channel.height."
    std::string block;  ///< "lcd-info.3."
  };
  PropertyMap own_;
  const PropertyMap* shared_;
  std::string place_;
  std::vector<Reference> references_;
};

}  // namespace tpm::files
