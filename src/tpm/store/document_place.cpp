#include "tpm/store/document_place.hpp"

#include <fmt/format.h>

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

}  // namespace tpm
