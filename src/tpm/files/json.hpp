#pragma once
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"

namespace tpm::files {

/// Keys keep the order in which they were written: reports are compared byte for byte.
using Json = nlohmann::ordered_json;

/// The results of `convert`, a member or a function, for the items.
template <class Items, class Convert>
[[nodiscard]] Json array_json(const Items& items, Convert convert) {
  Json array = Json::array();
  for (const auto& item : items) array.push_back(std::invoke(convert, item));
  return array;
}

/// Remarks as every JSON has them: a list of {"code", "text"}.
[[nodiscard]] Json remark_json(const Remark& remark);
[[nodiscard]] Json remarks_json(std::span<const Remark> remarks);

/// A number of a result with kResultDigits; null if it is not finite.
[[nodiscard]] Json or_null(double value);
/// A number of a result that need not be there; null if it is not.
[[nodiscard]] Json or_null(const std::optional<double>& value);

/// Strict JSON: duplicate keys, numbers that overflow and anything after the value are errors
/// (Error(bad_input) with file, line and column), which nlohmann-json alone lets pass.
[[nodiscard]] Json parse_json(std::string_view text, std::string_view where);

/// read_file and parse_json.
[[nodiscard]] Json read_json(const std::filesystem::path& path);

/// Pretty-printed with two spaces and a final line feed. Throws Error(numerical) naming the key
/// if a number is not finite, instead of writing null.
[[nodiscard]] std::string to_text(const Json& value);

/// Names the schema of a file for an editor. It may stand at the top of every file that has one.
inline constexpr const char* kSchemaKey = "$schema";

}  // namespace tpm::files
