#include "tpm/files/json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

/// Notices a key that comes twice in one object; nlohmann-json keeps the last one without a word.
class DuplicateKeys {
 public:
  bool operator()(int /*depth*/, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) open_.emplace_back();
    if (event == Json::parse_event_t::object_end) open_.pop_back();
    if (event == Json::parse_event_t::key) {
      auto key = parsed.get<std::string>();
      if (!open_.back().insert(key).second && duplicate_.empty()) duplicate_ = std::move(key);
    }
    return true;
  }
  [[nodiscard]] const std::string& duplicate() const { return duplicate_; }

 private:
  std::vector<std::set<std::string>> open_;
  std::string duplicate_;
};

/// Readers of JSON call themselves once for each level; no file of the project has more than a
/// dozen.
constexpr int kDeepestNesting = 200;

void require_finite(const Json& value, const std::string& key) {
  if (value.is_number_float() && !std::isfinite(value.get<double>())) {
    throw Error(ExitCode::numerical, key, "the result is not a finite number");
  }
  if (value.is_structured()) {
    for (const auto& [k, v] : value.items()) require_finite(v, fmt::format("{}/{}", key, k));
  }
}

}  // namespace

Json remark_json(const Remark& remark) {
  return {{"code", remark.code}, {"text", remark.text}};
}

Json remarks_json(std::span<const Remark> remarks) {
  return array_json(remarks, remark_json);
}

Json or_null(double value) {
  return std::isfinite(value) ? Json(rounded(value)) : Json(nullptr);
}

Json or_null(const std::optional<double>& value) {
  return value ? Json(rounded(*value)) : Json(nullptr);
}

Json parse_json(std::string_view text, std::string_view where) {
  DuplicateKeys watcher;
  Json value;
  try {
    value = Json::parse(
        text.begin(), text.end(), [&](int depth, Json::parse_event_t event, Json& parsed) {
          if (depth > kDeepestNesting) {
            throw bad_input(where,
                            fmt::format("is nested more than {} levels deep", kDeepestNesting),
                            "objects and arrays within each other a few times");
          }
          return watcher(depth, event, parsed);
        });
  } catch (const nlohmann::json::exception& error) {
    std::string what = error.what();
    if (const auto end = what.find("] "); end != std::string::npos) what = what.substr(end + 2);
    throw bad_input(where, printable(what, 160), "valid JSON");
  }
  if (!watcher.duplicate().empty()) {
    throw bad_input(
        where, fmt::format("key '{}' stands twice in one object", printable(watcher.duplicate())),
        "each key once");
  }
  return value;
}

Json read_json(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  if (const auto called = kind_without_json(text)) {
    throw bad_input(path.string(), fmt::format("this is {}", *called), "a JSON file");
  }
  return parse_json(text, path.string());
}

std::string to_text(const Json& value) {
  require_finite(value, "");
  return value.dump(2) + "\n";
}

}  // namespace tpm::files
