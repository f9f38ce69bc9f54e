// Declared in tpm/files/keys/file_kind.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/quantity_pattern.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/files/keys/file_kind.hpp"

namespace tpm::files {
namespace {

using Type = Form::Type;

/// A number as people write it: 1000000, not 1000000.0.
Json plain_number(double value) {
  constexpr double kWhole = 9007199254740992.0;  // 2^53
  if (value == std::round(value) && std::abs(value) <= kWhole) {
    return static_cast<std::int64_t>(value);
  }
  return value;
}

void add_range(const Range& range, Json& schema) {
  if (std::isfinite(range.least)) {
    schema[range.above ? "exclusiveMinimum" : "minimum"] = plain_number(range.least);
  }
  if (std::isfinite(range.most)) schema["maximum"] = plain_number(range.most);
}

/// The sign that a text must have for a quantity to be in range.
int sign_of(const Range& range) {
  if (range.least > 0.0 || (range.least == 0.0 && range.above)) return 1;
  return range.least == 0.0 ? 0 : -1;
}

class SchemaWriter {
 public:
  Json schema_of(const Form& form) {
    if (form.type == Type::later) return schema_of(*form.made());
    if (form.name.empty() && form.type != Type::quantity) return body_of(form);
    const std::string name = form.name.empty() ? name_of_quantity(form) : form.name;
    const bool known = definitions_.contains(name);
    if (!known) definitions_[name] = Json::object();  // its place, before those within
    Json body = body_of(form);
    if (known && definitions_.at(name) != body) {
      throw std::logic_error(fmt::format("two forms are called '{}'", name));
    }
    definitions_[name] = std::move(body);
    return {{"$ref", "#/definitions/" + name}};
  }

  Json body_of(const Form& form) {
    Json schema = Json::object();
    std::string said = form.sentence;
    for (const std::string& rule : form.rules) {
      said += fmt::format("{}{}", said.empty() ? "" : "; ", rule);
    }
    if (!said.empty()) schema["description"] = said;
    switch (form.type) {
      case Type::any:
        break;
      case Type::flag:
        schema["type"] = "boolean";
        break;
      case Type::whole:
      case Type::number:
        schema["type"] = form.type == Type::whole ? "integer" : "number";
        add_range(form.range, schema);
        break;
      case Type::quantity:
        add_quantity(form, schema);
        break;
      case Type::text:
        schema["type"] = "string";
        if (form.fewest > 0) schema["minLength"] = form.fewest;
        if (!form.pattern.empty()) schema["pattern"] = form.pattern;
        break;
      case Type::word:
        schema["enum"] = form.words;
        break;
      case Type::list:
        add_list(form, schema);
        break;
      case Type::map:
        schema["type"] = "object";
        if (form.fewest > 0) schema["minProperties"] = form.fewest;
        schema["additionalProperties"] = schema_of(*form.item);
        break;
      case Type::block:
        add_object(form.keys, "", "", false, schema);
        if (form.others_too) schema.erase("additionalProperties");
        break;
      case Type::kinds:
        add_kinds(form, schema);
        break;
      case Type::either:
        for (const FormPtr& one : form.forms) schema["anyOf"].push_back(schema_of(*one));
        break;
      case Type::later:
        return body_of(*form.made());
    }
    if (!form.null_too) return schema;
    Json or_null{{"anyOf", Json::array({Json{{"type", "null"}}, std::move(schema)})}};
    return or_null;
  }

  [[nodiscard]] Json definitions() && { return std::move(definitions_); }

 private:
  static std::string name_of_quantity(const Form& form) {
    const std::string name = fmt::format("{} {}{}", dimension_name(form.dimension),
                                         form.range.words(), form.plain_too ? " or plain" : "");
    std::string plain;  // of letters that stand in a URI as they are
    for (const char c : name) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-') {
        plain += c;
      } else if (!plain.empty() && plain.back() != '_') {
        plain += '_';
      }
    }
    while (plain.ends_with('_')) plain.pop_back();
    return plain;
  }

  static void add_quantity(const Form& form, Json& schema) {
    const Unit unit = shown_unit(form.dimension);
    const std::string range = form.range.words(si_symbol(form.dimension));
    if (!schema.contains("description")) {
      schema["description"] =
          fmt::format("a number and a unit of {}{}{}", dimension_name(form.dimension),
                      range.empty() ? "" : ", ", range);
    }
    schema["type"] = "string";
    schema["pattern"] = quantity_pattern(form.dimension, sign_of(form.range));
    schema["examples"] = {with_unit("2", unit)};
    if (!form.plain_too) return;
    schema["type"] = {"string", "number"};
    add_range(form.range, schema);
  }

  void add_list(const Form& form, Json& schema) {
    Json of = {{"type", "array"}, {"items", schema_of(*form.item)}};
    if (form.fewest > 0) of["minItems"] = form.fewest;
    if (form.most != std::numeric_limits<std::size_t>::max()) of["maxItems"] = form.most;
    if (form.distinct) of["uniqueItems"] = true;
    if (form.not_all_zero) of["contains"] = {{"not", {{"const", 0}}}};
    if (form.one_too) {
      schema["anyOf"] = {schema_of(*form.item), std::move(of)};
    } else {
      schema.update(of);
    }
  }

  Json key_schema(const KeyForm& key) {
    Json schema = schema_of(*key.form);
    if (schema.contains("$ref")) {  // whose neighbours do not count in draft 7
      Json reference = std::move(schema);
      schema = {{"allOf", Json::array({std::move(reference)})}};
    }
    if (!key.sentence.empty()) {
      const std::string own = schema.value("description", "");
      schema["description"] = own.empty() ? key.sentence : key.sentence + "; " + own;
    }
    if (!key.usual.is_null()) schema["default"] = key.usual;
    if (!key.example.is_null()) schema["examples"] = {key.example};
    return schema;
  }

  void add_object(const std::vector<KeyForm>& keys, const std::string& by, const std::string& kind,
                  bool kind_may_be_missing, Json& schema) {
    schema["type"] = "object";
    schema["additionalProperties"] = false;
    std::vector<std::string> needed;
    if (!by.empty() && !kind_may_be_missing) needed.push_back(by);
    for (const KeyForm& key : keys) {
      if (key.required) needed.push_back(key.name);
    }
    if (!needed.empty()) schema["required"] = needed;
    schema["properties"] = Json::object();
    if (!by.empty()) schema["properties"][by] = {{"const", kind}};
    for (const KeyForm& key : keys) schema["properties"][key.name] = key_schema(key);
  }

  void add_kinds(const Form& form, Json& schema) {
    schema["type"] = "object";
    Json all = Json::array();
    for (const KindForm& kind : form.kinds) {
      Json one{{"title", kind.word}};
      if (!kind.sentence.empty()) one["description"] = kind.sentence;
      add_object(kind.keys, form.by, kind.word, kind.word == form.usual_kind, one);
      all.push_back(std::move(one));
    }
    schema["oneOf"] = std::move(all);
  }

  Json definitions_ = Json::object();
};

}  // namespace

Json json_schema(const FileKind& kind) {
  SchemaWriter writer;
  Form form = *kind.form;
  form.sentence = kind.sentence;
  Json body = writer.body_of(form);
  const Json editors{{"type", "string"},
                     {"description", "the schema of this file, for editors; tpm does not read it"}};
  const auto add_editors_key = [&](Json& object) {
    Json properties{{kSchemaKey, editors}};
    properties.update(object.at("properties"));
    object["properties"] = std::move(properties);
  };
  if (body.contains("properties")) add_editors_key(body);
  if (body.contains("oneOf")) {
    for (Json& one : body["oneOf"]) add_editors_key(one);
  }
  Json schema{{"$schema", "http://json-schema.org/draft-07/schema#"},
              {"$id", "urn:tpmkit:schema:" + kind.name},
              {"title", kind.title}};
  schema.update(body);
  Json definitions = std::move(writer).definitions();
  if (!definitions.empty()) schema["definitions"] = std::move(definitions);
  return schema;
}

}  // namespace tpm::files
