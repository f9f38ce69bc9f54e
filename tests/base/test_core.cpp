#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinRel;

TEST_CASE("a message for one who calls the library names arguments in place of options") {
  const auto said = with_arguments_for_options;
  CHECK(said("--device: 'gloves'; expected --device-file") ==
        "device: 'gloves'; expected device_file");
  CHECK(said("m.csv: no column; expected --separator and --decimal (comma or point)") ==
        "m.csv: no column; expected separator and decimal (comma or point)");
  // Whole commands stay, and what is no option.
  for (const char* const same :
       {"d.json: is no file; expected one of tpm hil identify --device KIND", "a -- b --", "a--b",
        "not measured (tpm plan --calibrate measures)", "k = -1e-3", ""}) {
    CHECK(said(same) == same);
  }
  CHECK(said("a page (tpm validate --credibility), or --require 5%") ==
        "a page (tpm validate --credibility), or require 5%");
}

TEST_CASE("a quantity is a number and a unit of the right dimension") {
  CHECK_THAT(parse_quantity("12 kPa", Dimension::stress, "here"), WithinRel(12000.0, 1e-15));
  CHECK_THAT(parse_quantity("12.56 mm^2", Dimension::area, "here"), WithinRel(12.56e-6, 1e-15));
  CHECK_THAT(parse_quantity("5 Pa s", Dimension::viscosity, "here"), WithinRel(5.0, 1e-15));
  CHECK_THAT(parse_quantity("4mm", Dimension::length, "here"), WithinRel(4e-3, 1e-15));
  CHECK(split_quantity(" 2.5e-3 kPa s ").unit == "kPa s");
  CHECK(split_quantity("2.5e-3kPa").number == "2.5e-3");
  CHECK(split_quantity("4").unit.empty());
  CHECK_THAT(parse_quantity("1e3Pa", Dimension::stress, "here"), WithinRel(1e3, 1e-15));
  CHECK_THROWS_WITH(parse_quantity("4mm", Dimension::stress, "key E"),
                    Catch::StartsWith("key E: 'mm' is a unit of length"));
  CHECK_THROWS_WITH(
      parse_quantity("12 mm", Dimension::stress, "key E"),
      Catch::StartsWith("key E: 'mm' is a unit of length; expected a unit of stress"));
  CHECK_THROWS_WITH(parse_quantity("12", Dimension::stress, "key E"),
                    Catch::StartsWith("key E: '12' has no unit"));
  for (const char* wrong :
       {"nan kPa", "inf kPa", "1e400 kPa", "3,5 kPa", "kPa", "", "0x10 kPa", "0x10kPa", "infkPa"}) {
    CHECK_THROWS_AS(parse_quantity(wrong, Dimension::stress, "here"), Error);
  }
}

TEST_CASE("a share is a number or a percentage") {
  CHECK(find_share("0.1") == 0.1);
  CHECK(find_share("10%") == 0.1);
  CHECK(find_share("57%") == 0.57);
  CHECK(find_share("1 %") == 0.01);
  for (const char* wrong : {"", "%", "5%%", "%5", "nan%", "ten", "10 % of it"}) {
    CHECK_FALSE(find_share(wrong).has_value());
  }
}

TEST_CASE("units take the prefixes of the SI, powers, products and quotients") {
  const auto si = [](const char* text) { return parse_unit(text, "here").to_si; };
  struct Expected {
    const char* text;
    double to_si;
    Dimension dimension;
  };
  for (const Expected& e :
       {Expected{"fN", 1e-15, Dimension::force},
        {"pN", 1e-12, Dimension::force},
        {"nN", 1e-9, Dimension::force},
        {"\xC2\xB5N", 1e-6, Dimension::force},
        {"GPa", 1e9, Dimension::stress},
        {"mmHg", 133.322387415, Dimension::stress},
        {"hPa", 100.0, Dimension::stress},
        {"kgf/cm^2", 98066.5, Dimension::stress},
        {"N mm^-2", 1e6, Dimension::stress},
        {"N/mm\xC2\xB2", 1e6, Dimension::stress},
        {"mPa\xC2\xB7s", 1e-3, Dimension::viscosity},
        {"deg", 3.141592653589793 / 180.0, Dimension::angle},
        {"\xC2\xB0", 3.141592653589793 / 180.0, Dimension::angle},
        {"mrad", 1e-3, Dimension::angle},
        {"1/kPa", 1e-3, Dimension::compliance},
        {"Pa^-1", 1.0, Dimension::compliance},
        {"m/min", 1.0 / 60.0, Dimension::speed},
        {"deg/s", 1.0 / 360.0, Dimension::frequency},
        {"rad s\xE2\x81\xBB\xC2\xB9", 0.5 / 3.141592653589793, Dimension::frequency},
        {"N / m", 1.0, Dimension::stiffness}}) {
    INFO(e.text);
    CHECK_THAT(si(e.text), WithinRel(e.to_si, 1e-14));
    CHECK(parse_unit(e.text, "here").dimension == e.dimension);
  }
  CHECK(parse_unit("N/mm^2", "here").symbol == "MPa");
  CHECK(parse_unit("mN/mm", "here").symbol == "N/m");
  for (const char* wrong : {"10", "12", "x", "lbx", "N//m", "N/", "/s", "kkPa", "kg", "MM", "N^",
                            "mm^9", "k", "PA", "m^2^2", "k%"}) {
    INFO(wrong);
    CHECK_FALSE(is_unit(wrong));
  }
}

TEST_CASE("the reason of an error is its message without what was expected") {
  const Error error = bad_input("a.csv", "says 'x; expected y'", "a number");
  CHECK(error.reason() == "a.csv: says 'x; expected y'");
  CHECK(error.within("b").reason() == "b: a.csv: says 'x; expected y'");
  CHECK(error.within("b").what() == std::string("b: ") + error.what());
  CHECK(bad_input("a", "b").with_code(ExitCode::usage).reason() == "a: b");
}

TEST_CASE("JSON that nlohmann-json would let pass is refused") {
  CHECK_THROWS_WITH(parse_json(R"({"a": 1, "a": 2})", "f.json"),
                    "f.json: key 'a' stands twice in one object; expected each key once");
  CHECK_THROWS_WITH(parse_json(R"({"a": [1, {"b": 1e400}]})", "f.json"), Catch::Contains("f.json"));
  CHECK_THROWS_WITH(parse_json("{\"a\": 1,\n}", "f.json"), Catch::Contains("line 2"));
  CHECK_NOTHROW(parse_json(R"({"a": {"x": 1}, "b": {"x": 2}})", "f.json"));
  CHECK_THROWS_AS(to_text(Json{{"a", std::nan("")}}), Error);
}

TEST_CASE("remarks are written as a list of code and text, an empty one where there is none") {
  const std::vector<Remark> remarks{{"clipping", "3 samples"}, {"no_hold", "there is no hold"}};
  CHECK(remarks_json(remarks) == Json::parse(R"([{"code": "clipping", "text": "3 samples"},
    {"code": "no_hold", "text": "there is no hold"}])"));
  CHECK(remarks_json({}) == Json::array());
  CHECK(remark_texts(remarks) == std::vector<std::string>{"3 samples", "there is no hold"});
}

TEST_CASE("blanks before and behind a text are cut off") {
  CHECK(trimmed(" \t a b\t") == "a b");
  CHECK(trimmed(" \t ").empty());
  CHECK(trimmed("\n a \n") == "\n a \n");
  CHECK(trimmed("\n a \n", " \n") == "a");
}

TEST_CASE("SHA-256 matches the published test vector") {
  // FIPS 180-2, appendix B.1
  CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
