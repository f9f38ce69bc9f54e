#include "tpm/store/document_place.hpp"

#include <fmt/format.h>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"

namespace tpm {

DocumentPlace DocumentPlace::key(std::string_view name) const {
  return {where.find(": key ") == std::string::npos ? fmt::format("{}: key /{}", where, name)
                                                    : fmt::format("{}/{}", where, name)};
}

double quantity_at(const Json& object, std::string_view key, Dimension dimension,
                   const DocumentPlace& place) {
  return parse_quantity(object.at(std::string(key)).get<std::string>(), dimension,
                        place.key(key).where);
}

double positive_at(const Json& object, std::string_view key, Dimension dimension,
                   const DocumentPlace& place) {
  const double value = quantity_at(object, key, dimension, place);
  if (value > 0.0) return value;
  throw bad_input(place.key(key).where, fmt::format("{} {}", shortest(value), si_symbol(dimension)),
                  "a value above 0");
}

}  // namespace tpm
