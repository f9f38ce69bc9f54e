// The declaration of keys (files/keys): one line a key, from which reader, messages, writer and
// JSON Schema follow.
#include <catch2/catch.hpp>
#include <optional>

#include "refusal.hpp"
#include "tpm/files/keys/block.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/files/keys/more_types.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::Contains;

namespace {

enum class Shape { round, flat };
constexpr auto kShapeWords =
    std::to_array<Word<Shape>>({{Shape::round, "round"}, {Shape::flat, "flat"}});

struct Needle {
  double radius_m = 2e-3;
  std::optional<double> angle_rad;
  std::optional<double> from_s, until_s;
  int repeats = 1;
  Shape shape = Shape::round;
  std::vector<double> loads_N;
  std::array<double, 3> direction{0.0, 0.0, 1.0};
};

const Block<Needle>& needle_block() {
  static const Block<Needle> block(
      "needle", "what is pushed in",
      {required(
           key("radius", &Needle::radius_m, quantity(Dimension::length, kAboveZero), "its size")),
       key("angle", &Needle::angle_rad, quantity(Dimension::angle), "of its tip"),
       key("from", &Needle::from_s, quantity(Dimension::time), "when it begins"),
       key("until", &Needle::until_s, quantity(Dimension::time), "when it ends"),
       key("repeats", &Needle::repeats, whole<int>(1, 10), "how often"),
       key("shape", &Needle::shape, word(kShapeWords), "of its tip"),
       key("loads", &Needle::loads_N,
           list(quantity(Dimension::force, kZeroOrMore), {.fewest = 1, .most = 3, .one_too = true}),
           "the loads"),
       key("direction", &Needle::direction, direction(), "where to")},
      {{"until after from", [](const Needle& needle) -> std::optional<Fault> {
          if (!needle.from_s || !needle.until_s || *needle.until_s > *needle.from_s) {
            return std::nullopt;
          }
          return Fault{"until", "is not later"};
        }}});
  return block;
}

const FileKind& needle_kind() {
  static const FileKind kind{"needle", "A needle", "What is pushed in", needle_block().form()};
  return kind;
}

Needle needle(std::string_view text) {
  return needle_block().read(parse_json(text, "n"), DocumentPlace{"n"});
}

std::string refusal(std::string_view text) {
  return test::refusal_of([&] { (void)needle(text); });
}

}  // namespace

TEST_CASE("a declared block is read with its defaults", "[keys]") {
  const Needle least = needle(R"({"radius": "3 mm"})");
  CHECK(least.radius_m == Approx(3e-3));
  CHECK_FALSE(least.angle_rad);
  CHECK(least.repeats == 1);
  const Needle all = needle(R"({"radius": "3 mm", "angle": "90 deg", "repeats": 4.0,
    "shape": "flat", "loads": ["1 N", "20 mN"], "direction": [1, 0, 0]})");
  CHECK(*all.angle_rad == Approx(1.5707963267948966));
  CHECK(all.repeats == 4);  // 4.0 is a whole number for JSON Schema
  CHECK(all.shape == Shape::flat);
  CHECK(all.loads_N == std::vector<double>{1.0, 0.02});
  CHECK(needle(R"({"radius": "3 mm", "loads": "5 N"})").loads_N == std::vector<double>{5.0});
}

TEST_CASE("what a block has not declared is refused at its key, with what belongs there",
          "[keys]") {
  struct Case {
    const char *text, *expected;
  };
  for (const Case& c :
       {Case{R"({})",
             "n: key /radius: is missing; expected its size: a text of a number and a unit "
             "of length"},
        Case{R"({"radius": "3 mm", "shap": "flat"})",
             "n: key /shap: unknown key (did you mean 'shape'?); expected one of radius, angle"},
        Case{R"({"radius": 3})", "n: key /radius: is of the wrong type: 3; expected a text of"},
        Case{R"({"radius": "0 mm"})", "n: key /radius: 0 m; expected above 0 m"},
        Case{R"({"radius": "3 N"})", "n: key /radius: 'N' is a unit of force"},
        Case{R"({"radius": "3 mm", "repeats": 2.5})",
             "key /repeats: is of the wrong type: 2.5; expected a whole number, 1 to 10"},
        Case{R"({"radius": "3 mm", "repeats": 11})", "key /repeats: 11; expected 1 to 10"},
        Case{R"({"radius": "3 mm", "repeats": 1e300})", "key /repeats"},
        Case{
            R"({"radius": "3 mm", "shape": "rond"})",
            "key /shape: unknown word 'rond' (did you mean 'round'?); expected one of round, flat"},
        Case{R"({"radius": "3 mm", "loads": []})",
             "key /loads: a list of 0 items; expected 1 to 3 items"},
        Case{R"({"radius": "3 mm", "loads": ["1 N", "-1 N"]})",
             "key /loads/1: -1 N; expected 0 N or more"},
        Case{R"({"radius": "3 mm", "direction": [0, 0.0, 0]})", "key /direction: has no length"},
        Case{R"({"radius": "3 mm", "from": "2 s", "until": "1 s"})",
             "key /until: is not later; expected until after from"},
        Case{R"([1])", "n: is of the wrong type: array; expected an object"}}) {
    CAPTURE(c.text);
    CHECK_THAT(refusal(c.text), Contains(c.expected));
  }
}

TEST_CASE("what is written is what is not as usual, and is read again", "[keys]") {
  const Needle read = needle(R"({"radius": "3 mm", "shape": "flat", "repeats": 1})");
  const Json written = needle_block().write(read);
  CHECK(written.at("radius") == "3 mm");
  CHECK(written.at("shape") == "flat");
  CHECK_FALSE(written.contains("repeats"));
  CHECK_FALSE(written.contains("angle"));
  CHECK(needle(written.dump()).radius_m == read.radius_m);
}

TEST_CASE("a schema says what the reader says, with defaults, ranges and what keys mean",
          "[keys]") {
  const Json schema = json_schema(needle_kind());
  CHECK(schema.at("$id") == "urn:tpmkit:schema:needle");
  CHECK(schema.at("required") == Json::array({"radius"}));
  CHECK(schema.at("additionalProperties") == false);
  CHECK_THAT(schema.at("description").get<std::string>(), Contains("until after from"));
  const Json& keys = schema.at("properties");
  CHECK(keys.contains("$schema"));
  CHECK(nlohmann::json(keys.at("repeats")) == nlohmann::json({{"description", "how often"},
                                                              {"type", "integer"},
                                                              {"minimum", 1},
                                                              {"maximum", 10},
                                                              {"default", 1}}));
  CHECK(keys.at("shape").at("enum") == Json::array({"round", "flat"}));
  CHECK(keys.at("shape").at("default") == "round");
  CHECK(needle_block().read(example_of(needle_kind()), DocumentPlace{"example"}).radius_m > 0.0);
  CHECK_THAT(keys_section(needle_kind()), Contains("| `repeats` | whole number, 1 to 10 | `1` |"));
}

TEST_CASE("the schema of a file may be named in it, by a text", "[keys]") {
  CHECK_FALSE(
      checked(Json{{"$schema", "x"}, {"radius", "1 mm"}}, needle_kind(), "n").contains("$schema"));
  CHECK_THAT(test::refusal_of([] {
               (void)checked(Json{{"$schema", 1}, {"radius", "1 mm"}}, needle_kind(), "n");
             }),
             Contains("n: key /$schema: is of the wrong type"));
}

TEST_CASE("programs may put numbers in SI where files have quantities", "[keys]") {
  const Json filled{{"radius", 0.003}};
  CHECK_THROWS_AS(needle_block().read(filled, DocumentPlace{"n"}), Error);
  CHECK(needle_block().read(filled, DocumentPlace{"n"}, Numbers::also_si).radius_m == 0.003);
}

TEST_CASE(
    "forms without members: texts with a pattern, null, other keys, kinds by a key of their own",
    "[keys]") {
  Form by_key{.type = Form::Type::kinds, .name = "place"};
  by_key.by = "";
  by_key.kinds = {{"at", "", {required_key("at", quantity(Dimension::time).form, "when")}},
                  {"over",
                   "",
                   {required_key("over", list_form(number().form, 1), "when"),
                    optional_key("step", or_null(number().form), "between them")}}};
  const FormPtr whole_form = object_form(
      "thing", "",
      {required_key("name", text_like("^[a-z]+$", "small letters", "abc").form, "of it"),
       optional_key("place", shared(std::move(by_key)), "when"),
       optional_key("more", with_others(object_form("", "", {required_key("a", flag().form, "")})),
                    "whatever")});
  const FileKind kind{"thing", "A thing", "", whole_form};
  const auto answer = [&](const char* document) {
    return test::refusal_of([&] { (void)checked(parse_json(document, "t"), kind, "t"); });
  };
  for (const char* good : {R"({"name": "abc"})", R"({"name": "a", "place": {"at": "1 s"}})",
                           R"({"name": "a", "place": {"over": [1], "step": null}})",
                           R"({"name": "a", "more": {"a": true, "b": 7}})"}) {
    CAPTURE(good);
    CHECK(answer(good).empty());
  }
  CHECK_THAT(answer(R"({"name": "Abc"})"), Contains("key /name: 'Abc'; expected small letters"));
  CHECK_THAT(answer(R"({"name": "a", "place": {}})"),
             Contains("key /place: has no key that says what it is; expected one of at, over"));
  CHECK_THAT(answer(R"({"name": "a", "place": {"at": "1 s", "step": 1}})"),
             Contains("key /place/step: stands beside 'at'") && Contains("step goes with over"));
  CHECK_THAT(answer(R"({"name": "a", "place": {"over": [1], "step": "x"}})"),
             Contains("key /place/step: is of the wrong type"));
  CHECK_THAT(answer(R"({"name": "a", "more": {"b": 7}})"), Contains("key /more/a: is missing"));
  const Json schema = json_schema(kind);
  CHECK(schema["properties"]["name"]["pattern"] == "^[a-z]+$");
  CHECK(schema["definitions"]["place"]["oneOf"][0]["required"] == Json::array({"at"}));
  // A text of any length is refused without a matcher that calls itself for each byte.
  const std::string longest = R"({"name": ")" + std::string(10'000'000, 'a') + R"("})";
  CHECK_THAT(answer(longest.c_str()), Contains("expected small letters"));
}
