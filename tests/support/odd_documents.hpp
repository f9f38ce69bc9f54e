#pragma once
// Documents with odd changes, and what a JSON Schema and a form say of them.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/keys/file_kind.hpp"

namespace tpm::test {
using namespace files;

/// True for each document that python3-jsonschema accepts; none if no Python has it.
inline std::optional<std::vector<bool>> schema_verdicts(const Json& schema, const Json& documents) {
  const TempFolder folder;
  write_file(folder / "schema.json", to_text(schema));
  write_file(folder / "documents.json", documents.dump());
  const std::string out = folder / "verdicts.txt";
  const std::string command =
      "sh '" TPM_TEST_SOURCE_DIR "/tests/with_python.sh' jsonschema '" TPM_TEST_SOURCE_DIR
      "/tests/programs/schema_verdicts.py' '" +
      (folder / "schema.json") + "' '" + (folder / "documents.json") + "' > '" + out + "'";
  if (std::system(command.c_str()) != 0) return std::nullopt;
  std::vector<bool> verdicts;
  for (const char c : read_file(out)) {
    if (c == '0' || c == '1') verdicts.push_back(c == '1');
  }
  return verdicts;
}

/// Every rule that a form or one within it has.
inline void add_rules(const Form& form, std::set<std::string>& rules,
                      std::set<std::string>& ranges) {
  rules.insert(form.rules.begin(), form.rules.end());
  if (form.type == Form::Type::quantity) {
    ranges.insert(form.range.words(si_symbol(form.dimension)));
  }
  if (form.made) add_rules(*form.made(), rules, ranges);
  if (form.item) add_rules(*form.item, rules, ranges);
  for (const FormPtr& one : form.forms) add_rules(*one, rules, ranges);
  for (const KeyForm& key : form.keys) add_rules(*key.form, rules, ranges);
  for (const KindForm& kind : form.kinds) {
    for (const KeyForm& key : kind.keys) add_rules(*key.form, rules, ranges);
  }
}

/// Values that stand where others belong.
inline const std::vector<Json>& odd_values() {
  static const std::vector<Json> values{nullptr,
                                        true,
                                        0,
                                        1,
                                        3,
                                        -1,
                                        71.0,
                                        424.5,
                                        70000,
                                        1e7,
                                        "",
                                        "hello",
                                        "12",
                                        "12 mm",
                                        "-12 mm",
                                        "0 mm",
                                        "12 kPa",
                                        "12kPa",
                                        "-12 kPa",
                                        "0.012 MPa",
                                        "12 kpa",
                                        "12,5 kPa",
                                        "1e400 kPa",
                                        "4 s",
                                        "1 N",
                                        "4 mm/s",
                                        "4 mm/min",
                                        "2 mm^2",
                                        "3 N/m^2",
                                        "1 Pa s",
                                        "5 N/mm",
                                        "shell",
                                        "solid",
                                        "fcc",
                                        "sphere",
                                        "ball",
                                        "liver",
                                        "mesh",
                                        "star",
                                        "ramp_hold",
                                        "creep",
                                        "rk4",
                                        "linear",
                                        Json::array(),
                                        Json::array({1}),
                                        Json::array({0, 0, 0}),
                                        Json::array({0, 0, 1}),
                                        Json::array({"1 mm", "2 mm", "3 mm"}),
                                        Json::array({1, 1}),
                                        Json::object(),
                                        Json{{"kind", "sphere"}},
                                        Json{{"kind", "layer"}, {"layer", 1}, {"factor", 2}},
                                        Json{{"shape", "cubic"}, {"stiffening", "5 mm"}},
                                        Json{{"time", "1 s"}, {"load", "1 N"}}};
  return values;
}

inline void collect(const Json& part, const std::string& at, std::vector<std::string>& pointers) {
  pointers.push_back(at);
  if (!part.is_structured()) return;
  for (const auto& item : part.items()) collect(item.value(), at + "/" + item.key(), pointers);
}

/// Documents with one to three odd changes, the same in every run.
class OddDocuments {
  template <class List>
  const auto& one_of(const List& list) {
    return list[random_() % list.size()];
  }

 public:
  explicit OddDocuments(std::vector<Json> documents) : documents_(std::move(documents)) {
    for (const Json& document : documents_) {
      std::vector<std::string> pointers;
      collect(document, "", pointers);
      for (const std::string& pointer : pointers) {
        const std::size_t slash = pointer.rfind('/');
        if (slash == std::string::npos) continue;
        const std::string name = pointer.substr(slash + 1);
        if (name.find_first_not_of("0123456789") != std::string::npos) keys_.push_back(name);
      }
    }
    for (const char* more : {"shape", "filling", "lattice", "radius", "load", "hold", "step",
                             "masses", "springs", "comparison", "at", "point", "normal", "fraction",
                             "solver", "materal", "spacing", "seed"}) {
      keys_.emplace_back(more);
    }
  }

  Json next() {
    Json document = one_of(documents_);
    for (std::size_t changes = 1 + random_() % 3; changes > 0; --changes) change(document);
    return document;
  }

 private:
  void change(Json& document) {
    std::vector<std::string> pointers;
    collect(document, "", pointers);
    const std::string pointer = one_of(pointers);
    Json& part = document[Json::json_pointer(pointer)];
    switch (random_() % 4) {
      case 0:
        if (part.is_object() && !part.empty()) {
          auto item = part.begin();
          std::advance(item, static_cast<std::ptrdiff_t>(random_() % part.size()));
          part.erase(item);
        }
        break;
      case 1:
        if (part.is_object()) part[one_of(keys_)] = one_of(odd_values());
        break;
      case 2:
        if (part.is_array()) part.push_back(one_of(odd_values()));
        break;
      default:
        part = one_of(odd_values());
    }
  }

  std::vector<Json> documents_;
  std::vector<std::string> keys_;
  std::mt19937 random_{20};  // NOLINT(cert-msc51-cpp): the same in every run
};

inline constexpr std::size_t kOddDocuments = 2000;

/// Compares the schema of a kind with its form, of odd changes of some documents. What the schema
/// accepts and the form refuses is a quantity out of range, of another unit or not finite: a
/// pattern does not weigh.
inline void compare_schema_and_form(const FileKind& kind, const std::vector<Json>& bases,
                                    std::size_t count) {
  CAPTURE(kind.name);
  for (const Json& base : bases) {
    CHECK(refusal_of([&] { (void)checked(base, kind, "base"); }).empty());
  }
  OddDocuments odd(bases);
  Json documents = Json::array();
  while (documents.size() < count) documents.push_back(odd.next());
  const auto verdicts = schema_verdicts(json_schema(kind), documents);
  if (!verdicts) {
    WARN("no Python has jsonschema: the schema was not asked");
    return;
  }
  REQUIRE(verdicts->size() == count);
  std::set<std::string> rules, ranges;
  add_rules(*kind.form, rules, ranges);
  std::size_t accepted = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string refusal = refusal_of([&] { (void)checked(documents[i], kind, "odd.json"); });
    accepted += refusal.empty() ? 1 : 0;
    if ((*verdicts)[i] == refusal.empty()) continue;
    INFO(documents[i].dump());
    CAPTURE(refusal, (*verdicts)[i]);
    const std::size_t at = refusal.rfind("; expected ");
    const std::string expected = at == std::string::npos ? "" : refusal.substr(at + 11);
    CHECK((*verdicts)[i]);
    CHECK((ranges.contains(expected) || refusal.find("a unit of ") != std::string::npos ||
           refusal.find("finite number") != std::string::npos));
  }
  CHECK(accepted > 0);
  CHECK(accepted < count);
}

}  // namespace tpm::test
