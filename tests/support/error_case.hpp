#pragma once
// Bad input and how the program is run on it (test_errors.cpp).
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "temp_folder.hpp"

namespace tpm::test {

/// One bad input and how the program is run on it.
struct ErrorCase {
  std::string file_type;
  std::string what;
  std::string arguments;  ///< of tpm; "{}" stands for the folder, "{}/out" for what it may write
  std::function<void(const TempFolder&)> make;  ///< writes the bad files
};

using Files = std::vector<std::pair<std::string, std::string>>;

inline std::function<void(const TempFolder&)> with_files(Files list) {
  return [list = std::move(list)](const TempFolder& folder) {
    for (const auto& [name, bytes] : list) {
      std::ofstream(folder / name, std::ios::binary) << bytes;
    }
  };
}

/// `text` with its first `from` replaced; throws std::logic_error if there is none.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

inline const std::string kGarbage(
    "\x7F"
    "ELF\x02\x01\x00\x00\xFF\xFE\xA0",
    11);
inline constexpr std::size_t kLongLine = 100'000'000;

inline std::string long_line() {
  return std::string(kLongLine, '1') + "\n";
}

}  // namespace tpm::test
