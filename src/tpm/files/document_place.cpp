#include "tpm/files/document_place.hpp"

#include <fmt/format.h>

#include "tpm/base/namespaces.hpp"

namespace tpm::files {

DocumentPlace DocumentPlace::key(std::string_view name) const {
  DocumentPlace place;
  place.where = fmt::format("{}{}{}", where, below_key ? "/" : ": key /", name);
  place.below_key = true;
  return place;
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
