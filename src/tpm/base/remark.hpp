#pragma once
#include <span>
#include <string>
#include <vector>

namespace tpm::base {

/// A message about a result that does not change it: a warning, an assumption, a limit that was
/// passed. Programs read the code, people the text. The code is written where the remark is made,
/// in lower case with underscores ("outliers"); it stays when the text or its numbers change.
struct Remark {
  std::string code;
  std::string text;  ///< one sentence

  [[nodiscard]] bool operator==(const Remark&) const = default;
};

/// The texts of remarks, in their order.
[[nodiscard]] inline std::vector<std::string> remark_texts(std::span<const Remark> remarks) {
  std::vector<std::string> texts;
  texts.reserve(remarks.size());
  for (const Remark& remark : remarks) texts.push_back(remark.text);
  return texts;
}

}  // namespace tpm::base
