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

}  // namespace tpm::files
