#include "tpm/files/document_place.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {

DocumentPlace DocumentPlace::key(std::string_view name) const {
  return {where.find(": key ") == std::string::npos ? fmt::format("{}: key /{}", where, name)
                                                    : fmt::format("{}/{}", where, name)};
}

double quantity_of(const Json& value, Dimension dimension, std::string_view where) {
  return value.is_number() ? value.get<double>()
                           : parse_quantity(value.get<std::string>(), dimension, where);
}

double quantity_at(const Json& object, std::string_view key, Dimension dimension,
                   const DocumentPlace& place) {
  return quantity_of(object.at(std::string(key)), dimension, place.key(key).where);
}

double positive_at(const Json& object, std::string_view key, Dimension dimension,
                   const DocumentPlace& place) {
  const double value = quantity_at(object, key, dimension, place);
  if (value > 0.0) return value;
  throw bad_input(place.key(key).where, fmt::format("{} {}", shortest(value), si_symbol(dimension)),
                  "a value above 0");
}

void require_keys_of(const Json& block, std::string_view kind,
                     const std::vector<std::string_view>& needed,
                     const std::vector<std::string_view>& allowed, const DocumentPlace& place) {
  const auto in = [](const std::vector<std::string_view>& list, std::string_view key) {
    return std::find(list.begin(), list.end(), key) != list.end();
  };
  std::vector<std::string_view> known = needed;
  known.insert(known.end(), allowed.begin(), allowed.end());
  for (const auto& [key, value] : block.items()) {
    if (key == "kind" || in(known, key)) continue;
    throw bad_input(place.key(key).where, fmt::format("is no key of the kind '{}'", kind),
                    fmt::format("{}", fmt::join(known, ", ")));
  }
  for (const std::string_view key : needed) {
    if (block.contains(key)) continue;
    throw bad_input(place.key(key).where, "is missing",
                    fmt::format("'{}' needs {}", kind, fmt::join(needed, ", ")));
  }
}

}  // namespace tpm::files
