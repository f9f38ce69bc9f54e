#include "tpm/files/document_place.hpp"

#include <fmt/format.h>

#include "tpm/base/namespaces.hpp"

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

}  // namespace tpm::files
