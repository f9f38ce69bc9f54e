#include <catch2/catch.hpp>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/core/units.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/json.hpp"

using namespace tpm;
using Catch::Matchers::WithinRel;

TEST_CASE("a quantity is a number and a unit of the right dimension") {
  CHECK_THAT(parse_quantity("12 kPa", Dimension::stress, "here"), WithinRel(12000.0, 1e-15));
  CHECK_THAT(parse_quantity("12.56 mm^2", Dimension::area, "here"), WithinRel(12.56e-6, 1e-15));
  CHECK_THAT(parse_quantity("5 Pa s", Dimension::viscosity, "here"), WithinRel(5.0, 1e-15));
  CHECK_THROWS_WITH(
      parse_quantity("12 mm", Dimension::stress, "key E"),
      Catch::StartsWith("key E: 'mm' is a unit of length; expected a unit of stress"));
  CHECK_THROWS_WITH(parse_quantity("12", Dimension::stress, "key E"),
                    Catch::StartsWith("key E: '12' has no unit"));
  for (const char* wrong : {"nan kPa", "inf kPa", "1e400 kPa", "3,5 kPa", "kPa", "", "0x10 kPa"}) {
    CHECK_THROWS_AS(parse_quantity(wrong, Dimension::stress, "here"), Error);
  }
}

TEST_CASE("JSON that nlohmann-json would let pass is refused") {
  CHECK_THROWS_WITH(parse_json(R"({"a": 1, "a": 2})", "f.json"),
                    "f.json: key 'a' stands twice in one object; expected each key once");
  CHECK_THROWS_WITH(parse_json(R"({"a": [1, {"b": 1e400}]})", "f.json"), Catch::Contains("f.json"));
  CHECK_THROWS_WITH(parse_json("{\"a\": 1,\n}", "f.json"), Catch::Contains("line 2"));
  CHECK_NOTHROW(parse_json(R"({"a": {"x": 1}, "b": {"x": 2}})", "f.json"));
  CHECK_THROWS_AS(to_text(Json{{"a", std::nan("")}}), Error);
}

TEST_CASE("SHA-256 matches the published test vector") {
  // FIPS 180-2, appendix B.1
  CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
