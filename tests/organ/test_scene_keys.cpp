// The declaration of a scene's keys (files/keys): reader and JSON Schema say the same.
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "odd_documents.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpm/organ/scene/protocol_file.hpp"
#include "tpm/organ/scene/scene_keys.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
using Catch::Matchers::StartsWith;

namespace {

Json poke() {
  return read_json(TPM_TEST_SOURCE_DIR "/configs/liver_poke.json");
}

/// The scene with one part replaced, which a JSON pointer names.
Json poke_with(const char* pointer, Json value) {
  Json scene = poke();
  scene[Json::json_pointer(pointer)] = std::move(value);
  return scene;
}

Json poke_without(const char* key) {
  Json scene = poke();
  scene.erase(key);
  return scene;
}

std::string form_refusal(const Json& document) {
  return test::refusal_of([&] { (void)checked(document, scene_kind(), "s.json"); });
}

std::string reader_refusal(const Json& document) {
  return test::refusal_of([&] {
    (void)scene_block().made(checked(document, scene_kind(), "s.json"), DocumentPlace{"s.json"});
  });
}

}  // namespace

TEST_CASE("odd scenes: what a schema can say the reader refuses as the schema does", "[keys]") {
  struct Case {
    const char* called;
    Json scene;
    bool form;  ///< what schema and reader say
  };
  const Json liver{{"kind", "liver"}};
  Json comment = poke();
  comment["_comment"] = "x";
  Json misspelt = poke_without("material");
  misspelt["materal"] = Json::object();
  const std::vector<Case> cases{
      {"number 71.0", poke_with("/contacts/0/number", 71.0), true},
      {"number 70000", poke_with("/contacts/0/number", 70000), true},
      {"number 0", poke_with("/contacts/0/number", 0), false},
      {"E1 12", poke_with("/material/E1", "12"), false},
      {"E1 12 mm", poke_with("/material/E1", "12 mm"), false},
      {"E1 hello", poke_with("/material/E1", "hello"), false},
      {"E1 -12 kPa", poke_with("/material/E1", "-12 kPa"), false},
      {"E1 12000", poke_with("/material/E1", 12000), false},
      {"E1 12 kpa", poke_with("/material/E1", "12 kpa"), false},
      {"E1 12kPa", poke_with("/material/E1", "12kPa"), true},
      {"E1 12,5 kPa", poke_with("/material/E1", "12,5 kPa"), false},
      {"E1 0.012 MPa", poke_with("/material/E1", "0.012 MPa"), true},
      {"contacts missing", poke_without("contacts"), true},
      {"protocol missing", poke_without("protocol"), true},  // tpm network needs none
      {"material missing", poke_without("material"), true},
      {"anchors missing", poke_without("anchors"), true},
      {"formulation quasi_statc", poke_with("/formulation", {{"kind", "quasi_statc"}}), false},
      {"tolerance 5", poke_with("/tolerance", 5), false},
      {"tolerance -1", poke_with("/tolerance", -1), false},
      {"tolerance 1%", poke_with("/tolerance", "1%"), false},
      {"title empty", poke_with("/title", ""), true},
      {"title 5", poke_with("/title", 5), false},
      {"title null", poke_with("/title", nullptr), false},
      {"fraction 7", poke_with("/anchors/0/fraction", 7), false},
      {"normal on far_side", poke_with("/anchors/0/normal", {0, 0, 1}), false},
      {"anchors []", poke_with("/anchors", Json::array()), true},
      {"contacts []", poke_with("/contacts", Json::array()), false},
      {"outputs foo", poke_with("/outputs", {{"foo", 1}}), false},
      {"direction 0", poke_with("/contacts/0/direction", {0, 0, 0}), false},
      {"materal", misspelt, false},
      {"_comment", comment, false},
      {"count 424.5", poke_with("/organ/count", 424.5), false},
      {"count 3", poke_with("/organ/count", 3), true},
      {"unchanged", poke(), true},
  };
  Json documents = Json::array();
  for (const Case& c : cases) {
    CAPTURE(c.called);
    const std::string refusal = form_refusal(c.scene);
    CAPTURE(refusal);
    CHECK(refusal.empty() == c.form);
    documents.push_back(c.scene);
  }
  const auto verdicts = test::schema_verdicts(json_schema(scene_kind()), documents);
  if (!verdicts) {
    WARN("no Python has jsonschema: the schema was not asked");
    return;
  }
  REQUIRE(verdicts->size() == cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    CAPTURE(cases[i].called);
    CHECK((*verdicts)[i] == cases[i].form);
  }
}

TEST_CASE("odd scenes: what no schema sees is refused with its place; a byte order mark is read",
          "[keys]") {
  const std::string text = read_file(TPM_TEST_SOURCE_DIR "/configs/liver_poke.json");
  const auto with = [&](std::string_view part, std::string_view other) {
    std::string changed = text;
    const std::size_t at = changed.find(part);
    REQUIRE(at != std::string::npos);
    return changed.replace(at, part.size(), other);
  };
  const auto refusal = [](const std::string& scene) {
    return test::refusal_of([&] {
      (void)scene_block().made(checked(parse_json(scene, "s.json"), scene_kind(), "s.json"),
                               DocumentPlace{"s.json"});
    });
  };
  CHECK_THAT(refusal(with(R"("outputs")", R"("tolerance": NaN, "outputs")")),
             StartsWith("s.json: parse error at line 12, column 16"));
  CHECK_THAT(refusal(with(R"("count": 81})", R"("count": 81},)")),
             StartsWith("s.json: parse error at line 13, column 1"));
  CHECK_THAT(refusal(with("{", "{ // a scene")),
             StartsWith("s.json: parse error at line 1, column 3"));
  CHECK_THAT(refusal(with(R"("outputs")", R"("organ": {}, "outputs")")),
             StartsWith("s.json: key 'organ' stands twice in one object"));
  CHECK_THAT(refusal(with(R"("E1": "12 kPa")", R"("E1": "1e400 kPa")")),
             StartsWith("s.json: key /material/E1: '1e400' is not a finite number"));
  CHECK(refusal("\xEF\xBB\xBF" + text).empty());
}

TEST_CASE("schema and reader of scenes agree on 2,000 odd scenes, but for rules that are listed",
          "[keys]") {
  std::vector<Json> bases{poke(), example_of(scene_kind())};
  for (const char* name : {"liver_tumour", "liver_fig3", "liver_indentation", "budget_liver"}) {
    bases.push_back(read_json(std::string(TPM_TEST_SOURCE_DIR "/configs/") + name + ".json"));
  }
  bases.push_back(parse_json(R"({"organ": {"kind": "block", "cells": [4, 4, 2]},
    "bonds": {"support": 1.6, "rule": "per_bond", "lateral": "rope"},
    "material": {"Einf": "2 kPa", "branches": [{"g": "1 kPa", "tau": "2 s"}],
      "potential": {"shape": "cubic", "stiffening": "5 mm"},
      "regions": [{"kind": "ball", "centre": ["1 mm", "2 mm", "3 mm"], "radius": "4 mm", "factor": 3},
                  {"kind": "function", "factor": "1 + x"}], "between": "series"},
    "anchors": [{"kind": "inner_layer"}, {"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"],
      "normal": [0, 0, 1]}, {"kind": "spheres", "spheres": [1, 2]}], "sliders": [3],
    "contacts": [{"kind": "patch", "number": 5, "radius": "9 mm", "direction": [0, 0, 1], "share": 1}],
    "protocol": {"kind": "creep", "load": "0.1 N", "duration": "4 s"},
    "formulation": {"kind": "inertial", "damping_ratio": 0.2, "density_kg_per_m3": 1000},
    "outputs": {"times": ["1 s", "2 s"], "fields": ["force"]}, "tolerance": 1e-5})",
                             "base"));
  test::OddDocuments odd(bases);
  Json documents = Json::array();
  constexpr std::size_t kCount = 2000;
  while (documents.size() < kCount) documents.push_back(odd.next());
  const auto verdicts = test::schema_verdicts(json_schema(scene_kind()), documents);
  if (!verdicts) {
    WARN("no Python has jsonschema: the schema was not asked");
    return;
  }
  REQUIRE(verdicts->size() == kCount);
  std::set<std::string> rules, ranges;
  test::add_rules(*scene_block().form(), rules, ranges);
  std::size_t accepted = 0;
  std::map<std::string, int> by_rule;
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::string refusal = reader_refusal(documents[i]);
    if (refusal.empty()) {
      INFO(documents[i].dump());
      CHECK((*verdicts)[i]);
      ++accepted;
      continue;
    }
    if (!(*verdicts)[i]) continue;
    // The schema accepts what the reader refuses: a rule about several keys, or a quantity that a
    // pattern does not weigh.
    const std::size_t at = refusal.rfind("; expected ");
    const std::string expected = at == std::string::npos ? "" : refusal.substr(at + 11);
    const bool by_unit = refusal.find("a unit of ") != std::string::npos;
    const bool listed_rule = rules.contains(expected) || ranges.contains(expected) || by_unit ||
                             refusal.find("finite number") != std::string::npos;
    INFO(documents[i].dump());
    CAPTURE(refusal);
    CHECK(listed_rule);
    ++by_rule[by_unit ? "a unit" : expected];
  }
  CHECK(accepted > kCount / 20);
  CHECK(accepted < kCount / 2);
  for (const auto& [rule, count] : by_rule) {
    INFO(rule);
    CHECK(count > 0);
  }
}

TEST_CASE("the committed schemas of scenes and protocols are those of the declaration", "[keys]") {
  for (const FileKind* kind : {&scene_kind(), &protocol_kind()}) {
    CAPTURE(kind->name);
    CHECK(read_file(share_dir() / "schemas" / (kind->name + ".schema.json")) ==
          to_text(json_schema(*kind)));
  }
}

TEST_CASE("the examples of scenes and protocols are read", "[keys]") {
  CHECK(reader_refusal(example_of(scene_kind())).empty());
  CHECK_NOTHROW(parse_protocol_file(example_of(protocol_kind()), "example"));
  CHECK_NOTHROW(parse_experiment(example_of(scene_kind()), "example", {}));
}

TEST_CASE("a file of another kind is called by its name", "[keys]") {
  CHECK_THAT(form_refusal(read_json(TPM_TEST_SOURCE_DIR "/configs/hil_law.json")),
             StartsWith("s.json: this is a session; use tpm hil run"));
  CHECK_THAT(form_refusal(read_json(TPM_TEST_SOURCE_DIR "/configs/sweep_x_depth.json")),
             Contains("this is a sweep; use tpm sweep"));
  CHECK_THAT(test::refusal_of([] { require_not_other_kind(poke(), "hil", "s.json"); }),
             StartsWith("s.json: this is a scene; use tpm simulate"));
  const Json law = Json::parse(R"({"law": "linear-1", "response": "contact_force"})");
  CHECK_THAT(test::refusal_of([&] { require_not_other_kind(law, "scene", "a b.json"); }),
             Contains("use tpm material 'a b.json' SCENE --folder on_organ, which writes"));
  CHECK_THAT(test::refusal_of([&] { require_not_other_kind(law, "hil", "l.json"); }),
             Contains("use tpm hil run SESSION --law l.json;"));
  CHECK_THAT(test::refusal_of([&] { require_not_other_kind(law, "sweep", "l.json"); }),
             Contains("this is a fitted law; use tpm predict;"));
}

TEST_CASE("what is no JSON is called by what it is", "[keys]") {
  CHECK(kind_without_json("time [s],force [N]\n0,1\n") == "a table of samples");
  CHECK(kind_without_json("\xEF\xBB\xBFmade by hand\r\n\r\ntime\tforce\r\n0\t1\r\n") ==
        "a table of samples");
  CHECK(kind_without_json("\x89HDF\r\n").value_or("").starts_with("an HDF5 file"));
  CHECK(kind_without_json("<html></html>") == "a web page");
  for (const char* told : {"", " {\"a\": 1,\n", "[1,\n2]", "11111",
                           "\x7F"
                           "ELF,\x02\n"}) {
    CHECK_FALSE(kind_without_json(told));
  }
  const test::TempFolder folder;
  const auto law_in = [&](const char* name) {
    return test::refusal_of([&] { (void)read_json_of(folder / name, "law"); });
  };
  write_file(folder / "a.csv", "time [s],force [N]\n0,1\n");
  CHECK_THAT(law_in("a.csv"), Contains("this is a table of samples") && Contains("tpm fit"));
  CHECK_THAT(law_in("."), Contains("is a folder") && Contains("a fitted law"));
  write_file(folder / "law.json", "{}");
  CHECK_THAT(law_in("."), Contains("the file in it") && Contains("law.json"));
  // Others have a key `law`, too.
  const auto refused = [](const char* text) {
    return test::refusal_of([text] { require_not_other_kind(Json::parse(text), "law", "l.json"); });
  };
  CHECK_THAT(refused(R"({"law": "linear-1", "parameters": [], "data": []})"),
             Contains("the configuration of a fit"));
  CHECK_THAT(refused(R"({"protocol": {}})"), Contains("this is a protocol"));
  CHECK_THAT(refused(R"({"fitted_law": {}, "scene": {}, "law": ""})"),
             Contains("a law put on an organ"));
  CHECK_NOTHROW(require_not_other_kind(Json::parse(R"({"law": "", "protocol": {}})"), "law", ""));
}

TEST_CASE("a misspelt key makes no other kind of a file", "[keys]") {
  Json sweep = read_json(TPM_TEST_SOURCE_DIR "/configs/sweep_x_depth.json");
  sweep["axis"] = sweep.at("axes");
  sweep.erase("axes");
  CHECK_NOTHROW(require_not_other_kind(sweep, "sweep", "s.json"));
  Json study = read_json(TPM_TEST_SOURCE_DIR "/configs/organ_experiments.json");
  study.erase("tissues");
  CHECK_NOTHROW(require_not_other_kind(study, "organ_experiments", "s.json"));
}

TEST_CASE("what is written of a declaration is read again", "[keys]") {
  for (
      const char* text :
      {R"({"kind": "ramp_hold", "depth": "8 mm", "rate": "4 mm/s", "hold": "30 s"})",
       R"({"kind": "knots", "knots": [{"time": "0 s", "load": "0 N"}, {"time": "1 s", "load": "2 N"}]})"}) {
    const DocumentPlace place{"p"};
    const ProtocolBlock block = protocol_kinds().read(parse_json(text, "p"), place);
    const Json written = protocol_kinds().write(block);
    const ProtocolBlock again = protocol_kinds().read(written, place);
    CHECK(protocol_kinds().write(again) == written);
    CHECK(again.protocol(place).peak() == block.protocol(place).peak());
  }
}
