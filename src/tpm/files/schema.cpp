// Declared in tpm/files/json.hpp.
#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>
#include <vector>

#include "tpm/base/memory_reserve.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

using Path = std::vector<std::string>;
using Violation = valijson::ValidationResults::Error;

/// valijson's contexts are lists such as ["<root>", "[data]", "[0]"]; people read /data/0.
Path path_of(const std::vector<std::string>& context) {
  Path path;
  for (std::size_t i = 1; i < context.size(); ++i) {
    std::string part = context[i];
    if (part.size() > 1 && part.front() == '[' && part.back() == ']') {
      part = part.substr(1, part.size() - 2);
    }
    path.push_back(std::move(part));
  }
  return path;
}

std::string pointer(const Path& path) {
  std::string text;
  for (const std::string& part : path) text += "/" + printable(part);
  return text.empty() ? "/" : text;
}

/// Follows "#/definitions/x"; read_schema() leaves no other references.
const Json& resolved(const Json& schema, const Json& root) {
  const Json* rules = &schema;
  while (rules->is_object() && rules->contains("$ref")) {
    rules = &root.at(Json::json_pointer(rules->at("$ref").get<std::string>().substr(1)));
  }
  return *rules;
}

constexpr std::string_view kOwnDefinition = "#/definitions/";

/// Turns references of a part of the schema FILE into those of the root that takes FILE's
/// definitions in under "FILE#x"; adds the files that are referred to.
void redirect(Json& part, const std::string& file, std::set<std::string>& files) {
  if (part.is_object() && part.contains("$ref") && part.at("$ref").is_string()) {
    const auto reference = part.at("$ref").get<std::string>();
    const std::size_t own = reference.find(kOwnDefinition);
    const std::string name = reference.substr(own + kOwnDefinition.size());
    const std::string of = own == 0 ? file : reference.substr(0, own);
    if (!of.empty()) part["$ref"] = fmt::format("{}{}#{}", kOwnDefinition, of, name);
    if (own != 0) files.insert(of);
  }
  if (!part.is_structured()) return;
  for (Json& member : part) redirect(member, file, files);
}

/// A schema with the definitions of the files that it refers to ("protocol.schema.json#/...").
Json read_schema(std::string_view name) {
  const std::filesystem::path folder = share_dir() / "schemas";
  Json root = read_json(folder / fmt::format("{}.schema.json", name));
  std::set<std::string> wanted, taken;
  redirect(root, "", wanted);
  while (!wanted.empty()) {
    const std::string file = *wanted.begin();
    wanted.erase(wanted.begin());
    if (!taken.insert(file).second) continue;
    Json definitions = read_json(folder / file).at("definitions");
    redirect(definitions, file, wanted);
    for (auto& [word, definition] : definitions.items()) {
      root["definitions"][fmt::format("{}#{}", file, word)] = std::move(definition);
    }
  }
  return root;
}

/// The part of the schema that speaks of one member of an object or list; null if none does.
Json member_schema(const Json& schema, const std::string& part) {
  if (schema.contains("properties") && schema.at("properties").contains(part)) {
    return schema.at("properties").at(part);
  }
  for (const char* every : {"additionalProperties", "items"}) {
    if (schema.contains(every) && schema.at(every).is_object()) return schema.at(every);
  }
  return nullptr;
}

Json schema_at(const Json& root, const Path& path) {
  Json schema = root;
  for (const std::string& part : path) {
    schema = member_schema(resolved(schema, root), part);
    if (!schema.is_object()) return nullptr;
  }
  return schema;
}

std::string joined(const Json& words) {
  std::string text;
  for (const Json& word : words) {
    text += text.empty() ? "" : ", ";
    text += word.is_string() ? word.get<std::string>() : word.dump();
  }
  return text;
}

/// The keys that a file may have, without former names and "$schema", which only editors read.
std::vector<std::string> keys_of(const Json& properties) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : properties.items()) {
    if (!value.value("deprecated", false) && key != kSchemaKey) keys.push_back(key);
  }
  return keys;
}

/// @param place of the key, the last part of it
Error unknown_key(const std::string& at, const Path& place, const Json& rules) {
  if (!rules.contains("properties")) return bad_input(at, "unknown key", "no such key");
  const std::vector<std::string> known = keys_of(rules.at("properties"));
  return bad_input(at, "unknown key" + did_you_mean(place.back(), known),
                   fmt::format("one of {}", fmt::join(known, ", ")));
}

std::string type_words(const Json& type) {
  return type.is_array() ? joined(type) : type.get<std::string>();
}

/// What a value at this place should have been, in words of the file's author.
std::string expectation(const Json& schema, const Json& root) {
  if (!schema.is_object()) return {};
  const Json& rules = resolved(schema, root);
  std::string text;
  if (rules.contains("enum")) {
    text = "one of " + joined(rules.at("enum"));
  } else if (rules.contains("type")) {
    text = "JSON type " + type_words(rules.at("type"));
  }
  for (const Json* part : {&schema, &rules}) {
    if (!part->contains("description")) continue;
    const auto description = part->at("description").get<std::string>();
    return text.empty() ? description : fmt::format("{} ({})", text, description);
  }
  return text;
}

/// The word in single quotes at the end of valijson's message.
std::string quoted_word(const std::string& description) {
  const auto end = description.rfind('\'');
  if (end == std::string::npos || end == 0) return {};
  const auto begin = description.rfind('\'', end - 1);
  return begin == std::string::npos ? "" : description.substr(begin + 1, end - begin - 1);
}

/// valijson's words for what went wrong, without its full stop.
std::string plain(std::string description) {
  while (!description.empty() && description.back() == '.') description.pop_back();
  return printable(description, 160);
}

Error in_plain_words(const Violation& violation, const Json& root, std::string_view where) {
  Path path = path_of(violation.context);
  const std::string& said = violation.description;
  const Json schema = schema_at(root, path);
  const Json& rules = resolved(schema, root);
  constexpr std::string_view kUnknown = "Object contains a property that could not be validated";
  constexpr std::string_view kMissing = "Missing required property";
  const auto at = [where](const Path& place) {
    return fmt::format("{}: key {}", where, pointer(place));
  };
  if (said.starts_with(kUnknown)) {
    path.push_back(quoted_word(said));
    return unknown_key(at(path), path, rules);
  }
  if (said.starts_with(kMissing)) {
    path.push_back(quoted_word(said));
    return bad_input(at(path), "is missing", expectation(schema_at(root, path), root));
  }
  const std::string expected = expectation(schema, root);
  if (said.find("enum") != std::string::npos) {
    return bad_input(at(path), "is none of the known words", expected);
  }
  if (said.find("'type' constraint") != std::string::npos) {
    return bad_input(at(path), "is of the wrong type", expected);
  }
  return bad_input(at(path), plain(said), expected);
}

/// valijson keeps whole numbers in 64 bits with a sign and would take larger ones for negative.
void require_signed_range(const Json& value, const std::string& key, std::string_view where) {
  constexpr auto kLargest = std::numeric_limits<std::int64_t>::max();
  if (value.is_number_unsigned() && value.get<std::uint64_t>() > std::uint64_t{kLargest}) {
    throw bad_input(fmt::format("{}: key {}", where, key),
                    fmt::format("{} is too large", value.dump()),
                    fmt::format("at most {}", kLargest));
  }
  if (!value.is_structured()) return;
  for (const auto& [name, member] : value.items()) {
    require_signed_range(member, fmt::format("{}/{}", key, printable(name)), where);
  }
}

/// The innermost violation is the cause; those around it only say that something inside is wrong.
std::optional<Violation> innermost_violation(const nlohmann::json& rules,
                                             const nlohmann::json& document) {
  constexpr std::size_t kReserve = std::size_t{8} << 20U;
  MemoryReserve reserve(kReserve);  // valijson does not look whether it got what it asked for
  std::optional<Violation> innermost;
  {
    valijson::Schema schema;
    valijson::SchemaParser().populateSchema(valijson::adapters::NlohmannJsonAdapter(rules), schema);
    valijson::Validator validator;
    valijson::ValidationResults results;
    validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(document), &results);
    Violation error;
    while (results.popError(error)) {
      if (!innermost || error.context.size() > innermost->context.size()) innermost = error;
    }
  }
  reserve.require_unused();
  return innermost;
}

}  // namespace

void check_schema(const Json& value, std::string_view schema_name, std::string_view where) {
  require_not_other_kind(value, schema_name, where);
  require_signed_range(value, "", where);
  const Json root = read_schema(schema_name);
  const nlohmann::json schema_document = root;
  const nlohmann::json document = value;

  const std::optional<Violation> violation = innermost_violation(schema_document, document);
  if (violation) throw in_plain_words(*violation, root, where);
}

}  // namespace tpm::files
