#include <fmt/format.h>

#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>
#include <vector>

#include "tpm/core/error.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/json.hpp"

namespace tpm {
namespace {

/// valijson's contexts are lists such as ["<root>", "[data]", "[0]"]; people read /data/0.
std::string pointer(const std::vector<std::string>& context) {
  std::string path;
  for (std::size_t i = 1; i < context.size(); ++i) {
    std::string part = context[i];
    if (part.size() > 1 && part.front() == '[' && part.back() == ']') {
      part = part.substr(1, part.size() - 2);
    }
    path += "/" + part;
  }
  return path.empty() ? "/" : path;
}

/// In words of the file's author rather than of JSON Schema.
std::string in_plain_words(const std::string& description) {
  constexpr std::string_view kUnknown =
      "Object contains a property that could not be validated using 'properties' or "
      "'additionalProperties' constraints: ";
  if (description.starts_with(kUnknown)) {
    std::string key = description.substr(kUnknown.size());
    while (!key.empty() && key.back() == '.') key.pop_back();
    return "unknown key " + key;
  }
  std::string plain = description;
  while (!plain.empty() && plain.back() == '.') plain.pop_back();
  return plain;
}

}  // namespace

void check_schema(const Json& value, std::string_view schema_name, std::string_view where) {
  const auto path = share_dir() / "schemas" / fmt::format("{}.schema.json", schema_name);
  const nlohmann::json schema_document = read_json(path);
  const nlohmann::json document = value;

  valijson::Schema schema;
  valijson::SchemaParser parser;
  parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(schema_document), schema);
  valijson::Validator validator;
  valijson::ValidationResults results;
  if (validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(document), &results)) {
    return;
  }
  // The innermost violation is the cause; those around it only say that something inside is wrong.
  valijson::ValidationResults::Error error;
  valijson::ValidationResults::Error innermost;
  while (results.popError(error)) {
    if (error.context.size() > innermost.context.size()) innermost = error;
  }
  throw bad_input(
      where,
      fmt::format("key {}: {}", pointer(innermost.context), in_plain_words(innermost.description)),
      fmt::format("what schemas/{}.schema.json describes", schema_name));
}

}  // namespace tpm
