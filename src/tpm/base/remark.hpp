#pragma once
#include <span>
#include <string>
#include <vector>

#include "tpmkit/error.hpp"

namespace tpm::base {

/// The texts of remarks, in their order.
[[nodiscard]] inline std::vector<std::string> remark_texts(std::span<const Remark> remarks) {
  std::vector<std::string> texts;
  texts.reserve(remarks.size());
  for (const Remark& remark : remarks) texts.push_back(remark.text);
  return texts;
}

}  // namespace tpm::base
