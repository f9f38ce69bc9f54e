#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "tpm/files/json.hpp"

namespace tpm::files {

/// A file that holds no table of samples: what it is, and what to do instead.
struct OtherKind {
  std::string what;      ///< "is an Excel workbook (.xls)"
  std::string expected;  ///< "the sheet saved as CSV or text"
};

/// Names a file of another kind by its first bytes or, where they do not tell, by its ending. None
/// for what may be a table, a digitised figure or a JPK force file.
[[nodiscard]] std::optional<OtherKind> find_other_kind(std::string_view bytes,
                                                       std::string_view path);

/// Names a JSON document of this project that is no configuration of a fit: a law, a session, a
/// scene, a protocol.
[[nodiscard]] std::optional<OtherKind> find_other_document(const Json& document);

}  // namespace tpm::files
